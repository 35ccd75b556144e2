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

/// 1-based number of `word` among two choices.
int choose(std::string_view word, std::string_view first, std::string_view second,
           std::string_view sequence) {
  if (word == first) return 1;
  if (word == second) return 2;
  throw ConfigError(fmt::format("{}'{}' is neither {} nor {}",
                                word == sequence ? "" : fmt::format("'{}': ", sequence), word,
                                first, second));
}

/// Site of a symbol in its layer, or -1 if unknown.
template <class Symbol>
int site(Symbol s) {
  return static_cast<int>(s) - 1;
}

void add_symbol(const Architecture& a, std::string_view name, Layer layer, int at, double share,
                Stimulus& to) {
  if (at >= 0) add_input(a, name, index(layer), at, share, to);
}

}  // namespace

const Architecture& imitating(const Architecture& a) {
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
  constexpr std::array kNames{"?", "high", "low"};
  std::array<std::optional<double>, 2> share;  // of the probability; none: no goal of the task
  double left = 1.0, open = 0.0;
  for (const auto& [goal, probability] : goals) {
    if (goal != Goal::high && goal != Goal::low) throw ConfigError("expected goals high and low");
    const std::string name = kNames.at(static_cast<std::size_t>(goal));
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
    goals.push_back({static_cast<Goal>(choose(text.substr(0, equals), "high", "low", text))});
    if (equals == text.size()) continue;
    char* end = nullptr;
    goals.back().probability = std::strtod(text.c_str() + equals + 1, &end);
    if (end == text.c_str() + equals + 1 || *end != '\0') {
      throw ConfigError("'" + text + "': expected a probability from 0 to 1");
    }
  }
  return goals;
}

Stimulus task_stimulus(const Architecture& a, const TaskInput& task) {
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

void add_vision(const Architecture& a, const Demonstration& shown, Stimulus& to) {
  const auto add = [&](Layer layer, int at, double confidence) {
    if (at < 0) return;
    add_input(a, "vision", index(layer), at, confidence, to);
    for (std::size_t f = kLayers; f < a.fields.size(); ++f) {
      const int there = Architecture::site_index(a.fields[f], site_label(layer, at));
      if (there >= 0) add_input(a, "vision", f, there, confidence, to);
    }
  };
  add(Layer::sts_grip, site(shown.grip), shown.grip_confidence);
  add(Layer::sts_transport, site(shown.transport), shown.transport_confidence);
  add(Layer::pfc, site(shown.goal), shown.goal_confidence);
  add(Layer::color, site(shown.color), shown.color_confidence);
}

void add_plan(const Architecture& a, const Demonstration& planned, Stimulus& to) {
  add_symbol(a, "plan", Layer::f5_grip, site(planned.grip), 1.0, to);
  add_symbol(a, "plan", Layer::f5_transport, site(planned.transport), 1.0, to);
}

template <class Real>
TrialResult run_trial(Ladder<Real>& ladder, const Trial& trial,
                      const std::function<void(double)>& observe) {
  const Architecture& a = ladder.architecture();
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
  ladder.reset();
  for (long i = -steps(trial.preshape_s, a.dt_s); i < end; ++i) {
    ladder.step(stimulus(i));
    const double t_s = static_cast<double>(i + 1) * a.dt_s;
    for (const Layer layer : kAllLayers) {
      double& onset_s = result.onset_s[index(layer)];
      if (std::isnan(onset_s) && read_peaks(ladder, layer).count > 0) onset_s = t_s;
    }
    if (observe) observe(t_s);
  }
  for (const Layer layer : kAllLayers) result.peaks[index(layer)] = read_peaks(ladder, layer);
  result.decision = read_decision(ladder);
  return result;
}

Demonstration parse_sequence(std::string_view text) {
  std::vector<std::string_view> words;
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t comma = std::min(text.find(',', from), text.size());
    words.push_back(text.substr(from, comma - from));
    from = comma + 1;
  }
  if (words.size() != 3 && words.size() != 4) {
    throw ConfigError("'" + std::string(text) +
                      "': expected grip,transport,goal or grip,transport,goal,color");
  }
  Demonstration d;
  d.grip = static_cast<Grip>(choose(words[0], "precision", "full", text));
  d.transport = static_cast<Transport>(choose(words[1], "above", "below", text));
  d.goal = static_cast<Goal>(choose(words[2], "high", "low", text));
  if (words.size() == 4) d.color = static_cast<Color>(choose(words[3], "light", "dark", text));
  return d;
}

template <class Real>
bool rehearse(Ladder<Real>& ladder, const Demonstration& sequence) {
  const Architecture& a = ladder.architecture();
  const Decision decided = run_trial(ladder, {.shown = sequence}).decision;
  const bool agreed = decided.settled && decided.grip == sequence.grip &&
                      decided.transport == sequence.transport && decided.goal == sequence.goal;
  if (agreed) {
    const Stimulus task = task_stimulus(a);
    for (long i = steps(a.learning.window_s, a.dt_s); i > 0; --i) ladder.step(task, true);
  }
  ladder.reset();
  return agreed;
}

template TrialResult run_trial(Ladder<float>&, const Trial&, const std::function<void(double)>&);
template TrialResult run_trial(Ladder<double>&, const Trial&, const std::function<void(double)>&);
template bool rehearse(Ladder<float>&, const Demonstration&);
template bool rehearse(Ladder<double>&, const Demonstration&);

}  // namespace mimesis::cognition
