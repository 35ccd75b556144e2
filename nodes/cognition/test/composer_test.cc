// Activity of imported files against a scheme of its own, written from what dnf-composer does:
// elements act one after the other, cells count from 1, kernels end at 5 σ; and against figures
// that it publishes (tests/validation/data/1d/expected).
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "common/error.h"
#include "nodes/cognition/composer_file.h"
#include "nodes/cognition/field_network.h"
#include "nodes/cognition/test/files.h"

namespace mimesis::cognition {
namespace {

struct Bell {
  double amplitude, width, position;
};

/// One field of theirs with one lateral kernel.
struct Theirs {
  int cells;
  double tau, rest, dt;
  std::string type;  ///< of the activation
  double steep, shift;
  bool circular, normalized;
  Bell excitation, inhibition;  ///< of a Mexican hat; amplitude 0: a Gaussian kernel
  double global;
  std::vector<Bell> stimuli;
};

double output(const Theirs& t, double u) {
  const double d = u - t.shift;
  if (t.type == "heaviside") return d > 0.0 ? 1.0 : 0.0;
  if (t.type == "sigmoid") return 1.0 / (1.0 + std::exp(-t.steep * d));
  return 0.5 * (1.0 + t.steep * d / (1.0 + t.steep * std::abs(d)));
}

std::vector<double> bell(const Theirs& t, const Bell& b, const std::vector<int>& offsets) {
  std::vector<double> g;
  double sum = 0.0;
  for (const int d : offsets) {
    g.push_back(std::exp(-0.5 * d * d / (b.width * b.width)));
    sum += g.back();
  }
  for (double& v : g) v *= b.amplitude / (t.normalized ? sum : 1.0);
  return g;
}

/// u after so many steps with the stimuli, and as many without.
std::vector<double> run(const Theirs& t, int on, int off) {
  const double widest =
      std::max(t.excitation.width, t.inhibition.amplitude != 0.0 ? t.inhibition.width : 0.0);
  const int reach = static_cast<int>(std::ceil(5.0 * widest)), n = t.cells;
  int left = std::min(reach, n - 1), right = left;
  if (t.circular && reach > (n - 1) / 2) left = n / 2, right = (n - 1) / 2;
  std::vector<int> offsets;
  for (int d = -left; d <= right; ++d) offsets.push_back(d);
  const auto plus = bell(t, t.excitation, offsets), minus = bell(t, t.inhibition, offsets);
  std::vector<double> u(static_cast<std::size_t>(n), t.rest), lateral(u.size(), 0.0);
  for (int k = 0; k < on + off; ++k) {
    double all = 0.0;
    for (const double v : u) all += output(t, v);
    for (int x = 0; x < n; ++x) {  // the kernel first
      double sum = t.global * all;
      for (std::size_t j = 0; j < offsets.size(); ++j) {
        int y = x + offsets[j];
        if (t.circular) y = (y + n) % n;
        if (y >= 0 && y < n)
          sum += (plus[j] - minus[j]) * output(t, u[static_cast<std::size_t>(y)]);
      }
      lateral[static_cast<std::size_t>(x)] = sum;
    }
    for (int x = 0; x < n; ++x) {  // then the field
      double s = 0.0;
      for (const Bell& b : t.stimuli) {
        double d = std::abs(x + 1 - b.position);
        if (t.circular) d = std::min(d, n - d);
        s += k < on ? b.amplitude * std::exp(-0.5 * d * d / (b.width * b.width)) : 0.0;
      }
      double& v = u[static_cast<std::size_t>(x)];
      v += t.dt / t.tau * (-v + t.rest + s + lateral[static_cast<std::size_t>(x)]);
    }
  }
  return u;
}

std::string json(const Theirs& t) {
  const std::string circular = t.circular ? "true" : "false",
                    size = fmt::format(R"("x_max": {}, "d_x": 1.0)", t.cells);
  std::string inputs = R"(["k", "output"], ["noise", "output"])", rest;
  for (std::size_t i = 0; i < t.stimuli.size(); ++i) {
    inputs += fmt::format(R"(, ["s{}", "output"])", i);
    rest += fmt::format(
        R"(, {{"uniqueName": "s{}", "label": [2, "gauss stimulus"], {}, "inputs": null, "amplitude": {},
              "width": {}, "position": {}, "circular": {}, "normalized": false}})",
        i, size, t.stimuli[i].amplitude, t.stimuli[i].width, t.stimuli[i].position, circular);
  }
  const bool hat = t.inhibition.amplitude != 0.0;
  const std::string kernel =
      hat ? fmt::format(R"("label": [5, "mexican hat kernel"], "amplitudeExc": {}, "widthExc": {},
                           "amplitudeInh": {}, "widthInh": {})",
                        t.excitation.amplitude, t.excitation.width, t.inhibition.amplitude,
                        t.inhibition.width)
          : fmt::format(R"("label": [4, "gauss kernel"], "amplitude": {}, "width": {})",
                        t.excitation.amplitude, t.excitation.width);
  return fmt::format(
      R"({{"identifier": "test", "deltaT": {}, "elements": [
        {{"uniqueName": "k", {}, {}, "amplitudeGlobal": {}, "circular": {}, "normalized": {},
          "inputs": [["u", "output"]]}},
        {{"uniqueName": "u", "label": [1, "neural field"], {}, "tau": {}, "restingLevel": {},
          "activationFunction": {{"type": "{}", "{}": {}, "x_shift": {}}}, "inputs": [{}]}},
        {{"uniqueName": "noise", "label": [8, "normal noise"], {}, "inputs": null, "amplitude": 0.01}}{}]}})",
      t.dt, kernel, size, t.global, circular, t.normalized ? "true" : "false", size, t.tau, t.rest,
      t.type, t.type == "sigmoid" ? "steepness" : "beta", t.steep, t.shift, inputs, size, rest);
}

std::vector<double> imported(const Theirs& t, int on, int off) {
  const PassingFile file("composer.json");
  file.write(json(t));
  FieldNetwork<double> network(load_network(file.path));
  Stimulus shown(network.spec());
  const Stimulus none = shown;
  add_input(network.spec(), "stimulus", 0, -1, 1.0, shown);
  for (int k = 0; k < on + off; ++k) network.step(k < on ? shown : none);
  const auto u = network.field(std::size_t{0}).activity();
  return {u.begin(), u.end()};
}

double apart(const std::vector<double>& a, const std::vector<double>& b) {
  double worst = a.size() == b.size() ? 0.0 : 1e9;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    worst = std::max(worst, std::abs(a[i] - b[i]));
  }
  return worst;
}

// Kernels that reach around the axis, odd and even sizes, shifted activations, both ends.
TEST(Composer, ActivityIsThatOfTheirScheme) {
  const std::vector<Theirs> all = {
      {100, 25, -8, 5, "sigmoid", 5, 0.2, true, true, {8, 3, 0}, {0, 1, 0}, -0.02, {{10, 5, 50}}},
      {101,
       20,
       -5,
       1,
       "sigmoid",
       100,
       0,
       true,
       true,
       {21, 17, 0},
       {14, 19, 0},
       -0.1,
       {{9, 4, 2.5}, {8, 6, 70}}},
      {64,
       30,
       -4,
       2,
       "abs_sigmoid",
       40,
       -0.3,
       false,
       false,
       {1.1, 4, 0},
       {0.4, 9, 0},
       -0.05,
       {{7, 3, 1}, {6, 3, 64}}},
      {90,
       15,
       -6,
       3,
       "heaviside",
       1,
       0.5,
       false,
       true,
       {9, 2.5, 0},
       {0, 1, 0},
       0.01,
       {{9, 4, 40}}}};
  for (const Theirs& t : all) {
    for (const auto& [on, off] : {std::pair{1, 0}, {7, 0}, {200, 0}, {200, 50}}) {
      const auto ours = imported(t, on, off), theirs = run(t, on, off);
      EXPECT_LT(apart(ours, theirs), 1e-9) << t.type << ' ' << on << ' ' << off;
    }
    EXPECT_GT(std::ranges::max(imported(t, 200, 0)), 0.0) << t.type;
  }
}

// Published with six digits: their sigmoid is computed in single precision.
TEST(Composer, ActivityIsThatOfTheirPublishedFiles) {
  struct Published {
    Theirs file;
    int off;
    std::vector<std::pair<std::size_t, double>> u;
  };
  // What all of them share: 100 cells, circular, a Gaussian kernel.
  const auto file = [](double rest, const char* type, double steep, Bell kernel, double global,
                       std::vector<Bell> stimuli) {
    return Theirs{.cells = 100,
                  .tau = 25,
                  .rest = rest,
                  .dt = 25,
                  .type = type,
                  .steep = steep,
                  .shift = 0,
                  .circular = true,
                  .normalized = true,
                  .excitation = kernel,
                  .inhibition = {0, 1, 0},
                  .global = global,
                  .stimuli = std::move(stimuli)};
  };
  const std::vector<Published> all = {
      {file(-8, "sigmoid", 100, {8, 3, 0}, 0, {{10, 5, 50}}),  // 002
       0,
       {{0, -8},
        {31, -7.98419},
        {36, -7.54153},
        {42, -0.778836},
        {45, 5.64988},
        {49, 9.76401},
        {59, -5.68204}}},
      {file(-7, "heaviside", 1, {8, 3, 0}, 0, {{10, 5, 50}}),  // 016
       0,
       {{0, -7}, {36, -6.39755}, {41, -0.75155}, {43, 3.40578}, {49, 10.9039}, {57, -0.75155}}},
      {file(-7, "heaviside", 1, {8, 3, 0}, 0, {{10, 5, 50}}), 500, {{0, -7}, {49, -7}}},
      {file(-10, "abs_sigmoid", 100, {5, 3, 0}, -0.15, {{12, 5, 25}, {12.5, 5, 75}}),  // 023
       0,
       {{0, -12.1013},
        {20, -1.25489},
        {24, 3.68269},
        {50, -12.1013},
        {74, 4.18663},
        {78, -0.888316}}},
      {file(-10, "abs_sigmoid", 100, {6, 3, 0}, -0.15, {{10, 5, 25}, {10.5, 5, 75}}),  // 028
       500,
       {{0, -10.0045}, {74, -10.0045}}}};
  for (const Published& p : all) {
    const auto u = imported(p.file, 500, p.off);
    for (const auto& [cell, expected] : p.u) {
      EXPECT_NEAR(u[cell], expected, 6e-6 * std::max(1.0, std::abs(expected)))
          << p.file.type << cell;
    }
  }
}

TEST(Composer, FieldsAreLinkedByTheirKernels) {
  const PassingFile file("composer.dnf");
  file.write(R"({"deltaT": 5, "elements": [
    {"uniqueName": "a", "label": [1, "neural field"], "x_max": 50, "d_x": 0.5, "tau": 20, "restingLevel": -5,
     "activationFunction": {"type": "sigmoid", "steepness": 10, "x_shift": 0}, "inputs": [["s", "output"]]},
    {"uniqueName": "b", "label": [1, "neural field"], "x_max": 50, "d_x": 0.5, "tau": 20, "restingLevel": -5,
     "activationFunction": {"type": "sigmoid", "steepness": 10, "x_shift": 0}, "inputs": [["ab", "output"]]},
    {"uniqueName": "ab", "label": [4, "gauss kernel"], "x_max": 50, "d_x": 0.5, "amplitude": 9, "width": 3,
     "amplitudeGlobal": 0, "circular": true, "normalized": true, "inputs": [["a", "output"]]},
    {"uniqueName": "s", "label": [2, "gauss stimulus"], "x_max": 50, "d_x": 0.5, "amplitude": 20, "width": 4,
     "position": 10, "circular": true, "normalized": false, "inputs": null}]})");
  FieldNetwork<double> network(load_network(file.path));
  Stimulus shown(network.spec());
  add_input(network.spec(), "stimulus", 0, -1, 1.0, shown);
  for (int k = 0; k < 400; ++k) network.step(shown);
  // Closed form: u_b = h + Σ w f(u_a), as nothing else reaches b.
  std::vector<double> w;
  double sum = 0.0;
  for (int d = -15; d <= 15; ++d) sum += std::exp(-d * d / 18.0);
  const auto a = network.field(std::size_t{0}).activity(),
             b = network.field(std::size_t{1}).activity();
  ASSERT_EQ(a.size(), 100U);
  EXPECT_NEAR(a[19], 15.0, 1e-6);  // position 10 is cell 20 of 1 .. 100
  for (int x = 0; x < 100; ++x) {
    double s = -5.0;
    for (int d = -15; d <= 15; ++d) {
      const double u = a[static_cast<std::size_t>((x + d + 100) % 100)];
      s += 9.0 * std::exp(-d * d / 18.0) / sum / (1.0 + std::exp(-10.0 * u));
    }
    EXPECT_NEAR(b[static_cast<std::size_t>(x)], s, 1e-6) << x;
  }
}

TEST(Composer, RefusesWhatItDoesNotRead) {
  const Theirs good{100,  25,        -8,        5, "sigmoid",    5, 0, true,
                    true, {8, 3, 0}, {0, 1, 0}, 0, {{10, 5, 50}}};
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& why) {
    const PassingFile file("composer.json");
    file.write(json(good));
    file.replace(from, to);
    try {
      const FieldNetwork<double> network(load_network(file.path));
      ADD_FAILURE() << "accepted: " << to;
    } catch (const ConfigError& e) {
      const std::string line = e.what();
      EXPECT_NE(line.find(why), std::string::npos) << line;
      EXPECT_TRUE(line.starts_with(file.path)) << line;
    }
  };
  refused("gauss stimulus", "timed gauss stimulus",
          "element 's0': is a timed gauss stimulus, which is not read");
  refused("\"s0\", \"output\"", "\"s9\", \"output\"", "element 'u': its input 's9' is no element");
  refused("\"sigmoid\"", "\"tanh\"", "its activation is 'tanh', expected sigmoid");
  refused("\"x_max\": 100, \"d_x\": 1.0, \"inputs\": null, \"amplitude\": 10",
          "\"x_max\": 50, \"d_x\": 1.0, \"inputs\": null, \"amplitude\": 10",
          "element 's0': has 50 cells, expected the 100 of u");
  refused("\"tau\": 25", "\"tau\": 2",
          "u: neural field: the step must be positive and at most tau_s");
  refused("\"tau\"", "\"tua\"", "is no simulation of dnf-composer");
  refused("{\"identifier\"", "[\"identifier\"", "is no simulation of dnf-composer");
}

}  // namespace
}  // namespace mimesis::cognition
