#pragma once
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "nodes/synthesizer/sequence/action_plan.h"

namespace mimesis::synthesizer {

/// Lengths of actions are travels of the middle of the feet. Defaults: [M18 3.8.4] and biped.urdf.
struct StepPlanSettings {
  /// Comfortable lengths: mean and half range, action 1 and action 2.
  double normal_m = 0.533, normal_half_m = 0.028, reaching_m = 0.261, reaching_half_m = 0.098;
  double least_normal_m = 0.34;   ///< length of action 1, as trained
  double longest_step_m = 0.28;   ///< longest distance of one foot from the other
  double shortest_step_m = 0.03;  ///< shortest step of the right foot in action 2
  double most_reaching_m = 0.36;  ///< longest travel of action 2, as trained
  /// Longest step back, half of what the pattern generator can walk (it is as long both ways).
  double longest_back_m = 0.15;
  double stand_half_m = 0.03;  ///< about the comfortable final distance
  /// So much nearer or farther it may stand: arms reach 0.10 m nearer. Farther, the right arm is
  /// too short: it steps again.
  double stand_nearer_m = 0.08, stand_farther_m = 0.03;
  int most_normal = 12, most_reaching = 4, most_back = 2;  ///< actions in one plan
};

/// One step: the foot lands at x [m] along the way.
struct PlannedStep {
  Action action = kNormalStep;
  mocap::Side side = mocap::kRight;
  double x_m = 0.0;
  bool operator==(const PlannedStep&) const = default;
};

struct StepPlan {
  std::vector<PlannedStep> steps;  ///< empty: it stands where it shall
  double final_distance_m = 0.0;   ///< middle of the feet to the drawer's front, at the end
  double cost = 0.0;
};

/// Places of the feet along the way, and the current action.
struct FeetAlongWay {
  double support_m = 0.0, other_m = 0.0;  ///< the foot that the next step is counted from
  mocap::Side swing = mocap::kRight;      ///< next
  Action action = kNormalStep;            ///< under way, if `swing` is its second foot
  bool stands = true;                     ///< no step is under way
  /// The next step may lead back although the robot walks: its foot is on the ground beside the
  /// other one, or on its way back.
  bool may_step_back = false;
};

/// Steps that lead to the front at `front_m`. Actions are gait cycles of two steps, the right foot
/// first: action 1 is two steps of the same length, action 2 one of the right foot and the left
/// closes beside it; standing ends the plan. Among the possible plans, the one with the least
///   Σ ((length − mean)/half range)² over actions, + the same of the final distance, + 1 for every
/// action 2 but the last, + 1 for changing the current action is taken [cf. plan_actions()]. A
/// robot that begins with its left foot begins in the middle of an action.
///
/// If none is possible, the drawer is too near, and the robot steps back: up to `most_back` actions
/// 2 of negative length, from feet side by side; a foot that is in the air is first put down beside
/// the other one. This goes beyond [M18 3.8.4], whose robot walks forward only.
/// Deterministic; some 10 µs. Fails with the reason if no plan leads there.
tl::expected<StepPlan, Status> plan_steps(const FeetAlongWay& feet, double front_m,
                                          double comfortable_m,
                                          const StepPlanSettings& settings = {});

}  // namespace mimesis::synthesizer
