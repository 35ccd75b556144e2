#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "common/error.h"
#include "common/testing/no_malloc.h"
#include "nodes/cognition/neural_field.h"

namespace mimesis::cognition {
namespace {

constexpr double kStep_s = 0.002;

double sigmoid(double u, double slope, double threshold) {
  return 1.0 / (1.0 + std::exp(-slope * (u - threshold)));
}

FieldParams transient() {
  FieldParams p;
  p.neurons = 45;
  p.dx = 0.8;
  p.resting_level = -2.0;
  p.threshold1 = 0.0;
  p.excitation = 1.3;
  p.width = 3.0;
  p.inhibition = 0.0;
  p.decay = 0.6;
  return p;
}

void excite(NeuralField<double>& f) {
  for (std::size_t i = 0; i < f.input().size(); ++i) {
    f.input()[i] += 4.0 * std::exp(-0.5 * std::pow((static_cast<double>(i) - 20.0) / 4.0, 2));
  }
}

// One step against eq. 2.6 and 2.7 written down literally; v is rebuilt from the start.
TEST(TransientField, StepIsEquations26And27) {
  const FieldParams p = transient();
  NeuralField<double> field(p, kStep_s);
  const std::size_t n = 45;
  std::vector<double> u(n, p.resting_level), v(n, 0.0);
  for (int k = 0; k < 120; ++k) {
    std::vector<double> s(n, 0.0), du(n), dv(n);
    if (k < 30) {
      excite(field);
      s.assign(field.input().begin(), field.input().end());
    }
    for (std::size_t i = 0; i < n; ++i) {
      double excitation = 0.0, inhibition = 0.0;
      for (std::size_t j = 0; j < n; ++j) {
        const double d = (static_cast<double>(i) - static_cast<double>(j)) * 0.8;
        const double f = sigmoid(u[j], 2.0, 0.0);
        if (std::abs(d) <= 12.01) excitation += 1.3 * std::exp(-d * d / 18.0) * f * 0.8;
        if (std::abs(d) <= 32.01) inhibition += 0.6 * std::exp(-d * d / 128.0) * f * 0.8;
      }
      du[i] = -u[i] - 2.0 + s[i] + sigmoid(u[i], 2.0, 0.0) * (excitation - v[i]);
      dv[i] = -v[i] + sigmoid(v[i], 1.0, 1.0) * inhibition;
    }
    for (std::size_t i = 0; i < n; ++i) {
      u[i] += kStep_s / 0.020 * du[i];
      v[i] += kStep_s / 0.150 * dv[i];
    }
    const testing::NoMalloc guard;
    field.step();
  }
  for (std::size_t i = 0; i < n; ++i) EXPECT_NEAR(field.activity()[i], u[i], 1e-9) << i;
  EXPECT_GT(field.activity()[20], 1.0);
}

TEST(TransientField, InTwoDimensionsTheAnswerEndsToo) {
  FieldParams p = transient();
  p.neurons = p.rows = 32;
  p.dx = 1.0;
  p.excitation = 0.2;
  p.decay = 0.05;
  NeuralField<float> field(p, kStep_s);
  float highest = 0.0F;
  for (int k = 0; k < 500; ++k) {
    for (std::size_t i = 0; k < 30 && i < field.input().size(); ++i) {
      const double x = static_cast<double>(i % 32) - 16.0, y = static_cast<double>(i / 32) - 16.0;
      field.input()[i] += static_cast<float>(4.0 * std::exp(-0.5 * (x * x + y * y) / 16.0));
    }
    field.step();
    highest = std::max(highest, std::ranges::max(field.activity()));
  }
  EXPECT_GT(highest, 2.0F);
  EXPECT_LT(std::ranges::max(field.activity()), 0.0F);
}

TEST(TransientField, RefusesImpossibleConstants) {
  const auto refused = [](auto change) {
    FieldParams p = transient();
    change(p);
    EXPECT_THROW(NeuralField<double>(p, kStep_s), ConfigError);
  };
  refused([](FieldParams& p) { p.decay_tau_s = 0.01; });
  refused([](FieldParams& p) { p.decay_width = 2.0; });
  refused([](FieldParams& p) { p.decay = -1.0; });
  refused([](FieldParams& p) { p.decay = 0.0; });  // eq. 2.1 needs its inhibition
}

// With constant activity eq. 2.8 is linear: s(t) goes to s∞ = h α f f / (h + β) at (h + β) / τ_s.
TEST(ShuntedLink, FollowsTheClosedForm) {
  const ShuntedParams p;
  for (const auto& [u, rate, source] :
       {std::tuple{8.0, 0.9, 1.0}, {8.0, 0.9, 0.0}, {6.8, 0.5, 0.7}, {2.0, 0.4, 1.0}}) {
    const double h = sigmoid(u, p.slope, p.threshold);
    const double end = h * p.alpha * rate * source / (h + p.beta);
    const double exact = end + (0.3 - end) * std::exp(-0.1 * (h + p.beta) / p.tau_s);
    Link<double> link(1, 1, 1.0);
    link.fill(0.3);
    const std::vector<double> us{u}, rates{rate}, sources{source};
    for (int k = 0; k < 10000; ++k) {
      const testing::NoMalloc guard;
      link.learn_shunted(us, rates, sources, p, 1e-5);
    }
    EXPECT_NEAR(link.weight(0, 0), exact, 2e-5) << u << ' ' << source;
  }
}

}  // namespace
}  // namespace mimesis::cognition
