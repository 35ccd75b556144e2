#include "nodes/cognition/trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "common/error.h"

namespace mimesis::cognition {
namespace {

long steps(double duration_s, double dt_s) { return std::lround(duration_s / dt_s); }

/// Site of a symbol in its layer, or -1 if unknown.
template <class Symbol>
int site(Symbol s) {
  return static_cast<int>(s) - 1;
}

void add_symbol(const NetworkSpec& a, std::string_view name, Layer layer, int at, double share,
                Stimulus& to) {
  if (at >= 0) add_input(a, name, index(layer), at, share, to);
}

}  // namespace

const NetworkSpec& imitating(const NetworkSpec& a) {
  for (const Layer layer : kAllLayers) {
    const std::size_t i = index(layer);
    std::vector<std::string> expected;
    for (int s = 0; s < sites(layer); ++s) expected.emplace_back(site_label(layer, s));
    if (i < a.fields.size() && a.fields[i].name == layer_name(layer) &&
        a.fields[i].sites == expected) {
      continue;
    }
    a.fail(fmt::format("fields.{}", i),
           fmt::format("a robot that imitates needs {} here, with the sites {}", layer_name(layer),
                       fmt::join(expected, ", ")));
  }
  return a;
}

std::array<double, 2> expected_goals(const std::vector<ExpectedGoal>& goals) {
  std::array<std::optional<double>, 2> share;  // of the probability; none: no goal of the task
  double left = 1.0, open = 0.0;
  for (const auto& [goal, probability] : goals) {
    if (goal != Goal::high && goal != Goal::low) throw ConfigError("expected goals high and low");
    const std::string name(task::word(goal));
    auto& p = share.at(static_cast<std::size_t>(goal) - 1);
    if (p) throw ConfigError(name + " is there twice");
    if (probability && !(*probability >= 0.0 && *probability <= 1.0)) {
      throw ConfigError(
          fmt::format("{} has the probability {}, expected 0 to 1", name, *probability));
    }
    p = probability.value_or(-1.0);
    left -= probability.value_or(0.0);
    open += probability ? 0.0 : 1.0;
  }
  if (left < -1e-9) throw ConfigError("the probabilities of the goals exceed 1");
  std::array<double, 2> expected{};
  for (const std::size_t g : {0U, 1U}) {
    double p = share[g].value_or(0.0);
    if (p < 0.0) p = std::max(left, 0.0) / open;
    expected[g] = 2.0 * p / (p + 0.5);
  }
  return expected;
}

std::vector<ExpectedGoal> parse_goals(const std::vector<std::string>& texts) {
  std::vector<ExpectedGoal> goals;
  for (const std::string& text : texts) {
    const std::size_t equals = std::min(text.find('='), text.size());
    goals.push_back({task::parse_symbol<Goal>(text.substr(0, equals))});
    if (equals == text.size()) continue;
    char* end = nullptr;
    goals.back().probability = std::strtod(text.c_str() + equals + 1, &end);
    if (end == text.c_str() + equals + 1 || *end != '\0') {
      throw ConfigError("'" + text + "': expected a probability from 0 to 1");
    }
  }
  return goals;
}

Stimulus task_stimulus(const NetworkSpec& a, const TaskInput& task) {
  Stimulus s(a);
  for (const Layer layer : kAllLayers) {
    if (layer == Layer::pfc) {
      for (const int goal : {0, 1}) {
        const double share = task.goal * task.each_goal[static_cast<std::size_t>(goal)];
        add_input(a, "task", index(layer), goal, share, s);
      }
      continue;
    }
    add_input(a, "task", index(layer), -1, layer == Layer::pf ? task.means : 1.0, s);
  }
  return s;
}

void add_vision(const NetworkSpec& a, const Demonstration& shown, Stimulus& to) {
  const auto add = [&](Layer layer, int at, double confidence) {
    if (at < 0) return;
    add_input(a, "vision", index(layer), at, confidence, to);
    for (std::size_t f = kLayers; f < a.fields.size(); ++f) {
      const int there = NetworkSpec::site_index(a.fields[f], site_label(layer, at));
      if (there >= 0) add_input(a, "vision", f, there, confidence, to);
    }
  };
  add(Layer::sts_grip, site(shown.grip), shown.grip_confidence);
  add(Layer::sts_transport, site(shown.transport), shown.transport_confidence);
  add(Layer::pfc, site(shown.goal), shown.goal_confidence);
  add(Layer::color, site(shown.color), shown.color_confidence);
}

void add_plan(const NetworkSpec& a, const Demonstration& planned, Stimulus& to) {
  add_symbol(a, "plan", Layer::f5_grip, site(planned.grip), 1.0, to);
  add_symbol(a, "plan", Layer::f5_transport, site(planned.transport), 1.0, to);
}

template <class Real>
TrialResult run_trial(FieldNetwork<Real>& network, const Trial& trial,
                      const std::function<void(double)>& observe) {
  const NetworkSpec& a = network.spec();
  const long window = steps(a.input_window_s, a.dt_s), end = steps(trial.duration_s, a.dt_s);
  const Stimulus task = task_stimulus(a, trial.task);
  const auto stimulus = [&](long i) {
    const auto present = [&](double from_s) {
      return i >= steps(from_s, a.dt_s) && i < steps(from_s, a.dt_s) + window;
    };
    Stimulus s = task;
    if (present(0.0)) add_vision(a, trial.shown, s);
    for (const LaterInput& later : trial.later) {
      if (!present(later.at_s)) continue;
      add_vision(a, later.shown, s);
      add_plan(a, later.planned, s);
    }
    return s;
  };

  TrialResult result;
  result.onset_s.fill(std::numeric_limits<double>::quiet_NaN());
  network.reset();
  for (long i = -steps(trial.preshape_s, a.dt_s); i < end; ++i) {
    network.step(stimulus(i));
    const double t_s = static_cast<double>(i + 1) * a.dt_s;
    for (const Layer layer : kAllLayers) {
      double& onset_s = result.onset_s[index(layer)];
      if (std::isnan(onset_s) && read_peaks(network, layer).count > 0) onset_s = t_s;
    }
    if (observe) observe(t_s);
  }
  for (const Layer layer : kAllLayers) result.peaks[index(layer)] = read_peaks(network, layer);
  result.decision = read_decision(network);
  return result;
}

template <class Real>
bool rehearse(FieldNetwork<Real>& network, const Demonstration& sequence) {
  const NetworkSpec& a = network.spec();
  const Decision decided = run_trial(network, {.shown = sequence}).decision;
  const bool agreed = decided.settled && decided.grip == sequence.grip &&
                      decided.transport == sequence.transport && decided.goal == sequence.goal;
  if (agreed) {
    const Stimulus task = task_stimulus(a);
    for (long i = steps(a.learning.window_s, a.dt_s); i > 0; --i) network.step(task, true);
  }
  network.reset();
  return agreed;
}

template TrialResult run_trial(FieldNetwork<float>&, const Trial&,
                               const std::function<void(double)>&);
template TrialResult run_trial(FieldNetwork<double>&, const Trial&,
                               const std::function<void(double)>&);
template bool rehearse(FieldNetwork<float>&, const Demonstration&);
template bool rehearse(FieldNetwork<double>&, const Demonstration&);

}  // namespace mimesis::cognition
