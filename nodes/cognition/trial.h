#pragma once
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "nodes/cognition/field_network.h"
#include "nodes/cognition/imitator.h"

namespace mimesis::cognition {

struct ExpectedGoal {
  Goal goal;
  std::optional<double> probability{};  ///< 0..1; none: an even part of what the others leave [1]
};
/// What a task leads to expect of each goal: their number, identity and probability [M18 2.2.1]. A
/// goal of probability p gets the share 2p / (p + 1/2): 1 for an even choice of two, less for more
/// of them, 4/3 if it is certain, which still ignites nothing.
/// @throws ConfigError for an unknown or repeated goal, or probabilities that cannot be
std::array<double, 2> expected_goals(const std::vector<ExpectedGoal>& goals);
/// "high" or "high=0.8". @throws ConfigError for an unknown goal, or no number
std::vector<ExpectedGoal> parse_goals(const std::vector<std::string>& texts);

/// Task input: preshapes the familiar combinations of means and both goals.
Stimulus task_stimulus(const NetworkSpec& spec, const TaskInput& task = {});
/// Adds what vision saw, also to other fields that have an input `vision` and sites of these names;
/// unknown symbols add nothing.
void add_vision(const NetworkSpec& spec, const Demonstration& shown, Stimulus& to);
/// Adds the means of a test plan in F5 [M18 2.4.3, fig. 2.22].
void add_plan(const NetworkSpec& spec, const Demonstration& planned, Stimulus& to);

/// The same spec, if it begins with the fields of symbols.h and their sites.
/// @throws ConfigError that names what is missing
const NetworkSpec& imitating(const NetworkSpec& spec);

/// What reaches the fields after the onset of a demonstration, for input.window_s.
struct LaterInput {
  double at_s;              ///< from the onset of the demonstration [s]
  Demonstration shown{};    ///< parts that vision sees only now
  Demonstration planned{};  ///< means for which the planner found a motion
};

/// One run of the network from rest: task input alone, then a demonstration, then relaxation.
struct Trial {
  Demonstration shown{};
  TaskInput task{};         ///< constant input, whole by default
  double preshape_s = 1.0;  ///< task input before the demonstration [s]
  double duration_s = 2.0;  ///< from the onset of the demonstration [s]
  std::vector<LaterInput> later{};
};

/// Events of a trial; times from the onset of the demonstration.
struct TrialResult {
  std::array<double, kLayers> onset_s{};  ///< first u > 0 of each field; NaN if never [s]
  std::array<Peaks, kLayers> peaks;       ///< at the end
  Decision decision;                      ///< at the end

  double onset(Layer layer) const { return onset_s[index(layer)]; }
  int site(Layer layer) const { return peaks[index(layer)].site; }
};

/// Runs one trial; links stay as they are. `observe(t_s)` is called after every step.
template <class Real>
TrialResult run_trial(FieldNetwork<Real>& network, const Trial& trial,
                      const std::function<void(double)>& observe = {});

/// Practises one sequence in the familiar task: shows it, waits for the stable state, rewards it
/// for the learning window [M18 eq. 2.3]. False, and nothing learned, if the robot settled on
/// something else.
template <class Real>
bool rehearse(FieldNetwork<Real>& network, const Demonstration& sequence);

extern template TrialResult run_trial(FieldNetwork<float>&, const Trial&,
                                      const std::function<void(double)>&);
extern template TrialResult run_trial(FieldNetwork<double>&, const Trial&,
                                      const std::function<void(double)>&);
extern template bool rehearse(FieldNetwork<float>&, const Demonstration&);
extern template bool rehearse(FieldNetwork<double>&, const Demonstration&);

}  // namespace mimesis::cognition
