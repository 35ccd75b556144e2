#pragma once
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "nodes/synthesizer/sequence/trials.h"

namespace mimesis::synthesizer {

struct StepRange {
  double least_m = 0.0, mean_m = 0.0, most_m = 0.0;  ///< travel of the pelvis
  /// Duration by least squares on the length, within the trained durations.
  double duration_mean_s = 0.0, duration_slope_s_m = 0.0;
  double shortest_s = 0.0, longest_s = 0.0;

  double duration_s(double length_m) const;
  bool holds(double length_m) const;  ///< within the trained lengths (1 µm for rounding)
};

struct ActionRanges {
  StepRange normal, reaching;
  double nearest_stand_m = 0.0, farthest_stand_m = 0.0;  ///< trained final distances
  double standing_s = 0.0;                               ///< mean duration of action 3
};
/// @throws ConfigError if an action has no trials.
ActionRanges ranges_of(const std::array<mocap::Trials, kActions>& trials);

struct PlanSettings {
  double final_distance_m = 0.60;  ///< most comfortable for action 3 [M18 3.4.2]
  /// Share of the way that each of the two steps of a normal cycle takes [M18 3.4.2]. The text's
  /// D₁ = (D − 0.6 m)γ is read as the first step, D₂ = (D − 0.6 m)(1 − γ) as the rest: the second
  /// step and action 2. Then action 2 travels (1 − 2γ)(D − 0.6 m) = 0.40 .. 0.54 m for D = 2.34 ..
  /// 2.94 m, as fig. 3.38 has it (0.39 and 0.53 m), and a cycle 1.34 .. 1.80 m, as people walk;
  /// read as whole actions, the shortened one would be 1.07 .. 1.44 m long, twice the normal one.
  double gamma = 0.385;
  /// Distance beyond the trained final ones that arms and trunk compensate. About half the shortest
  /// trained step, so that no goal falls between standing and stepping.
  double reach_margin_m = 0.06;
  int most_normal = 10;   ///< cycles in one plan
  int most_reaching = 4;  ///< shortened ones
};

struct PlannedAction {
  Action action = kStanding;
  double length_m = 0.0;  ///< travel of the pelvis
  double duration_s = 0.0;
  bool operator==(const PlannedAction&) const = default;
};

/// Predictive plan of the actions that lead from a pelvis `distance_m` before the front panel to
/// the grasp: n normal cycles, m shortened ones, standing last. One of each (n = m = 1) is [M18
/// 3.4.2]; with n more cycles the lengths keep the proportion 2γ : 1 − 2γ; near goals are reached
/// by shortened steps alone. Lengths stay within the trained range; among the possible plans the
/// one with least Σ((length − trained mean)/half trained range)² + the same of the final distance +
/// 1 for every shortened step but one (it interrupts the walk) is taken. Deterministic; some 10 µs
/// (replanning: 100). Fails with the reason if no trained sequence leads there; a drawer that is
/// too near is refused, as in the dissertation (a robot steps back: plan_steps()).
tl::expected<std::vector<PlannedAction>, Status> plan_actions(double distance_m,
                                                              const ActionRanges& ranges,
                                                              const PlanSettings& settings = {});

struct Underway {
  Action action = kNormalStep;
  double planned_length_m = 0.0;
  double walked_m = 0.0;  ///< distance walked in this action
  double share = 0.0;     ///< share of its duration that is over, [0, 1)
};

/// Plans again in the middle of an action: the first action of the plan is the current one with its
/// new whole length, which its remaining part can still reach: at each instant the pelvis moves no
/// slower than in the shortest and no faster than in the longest trained step. `distance_m`: from
/// the pelvis now. If the goal cannot be reached the reason is returned and the old plan may be
/// kept.
tl::expected<std::vector<PlannedAction>, Status> replan_actions(const Underway& now,
                                                                double distance_m,
                                                                const ActionRanges& ranges,
                                                                const PlanSettings& settings = {});

}  // namespace mimesis::synthesizer
