#pragma once
#include <limits>
#include <string>
#include <vector>

#include "common/kin/arm.h"
#include "nodes/planner/verb/plan_file.h"

namespace mimesis::tool {

struct PlanVerdict {
  std::vector<std::string> findings;  ///< a line each; none: the plan is proven
  std::size_t left_out = 0;           ///< findings beyond the first ones
  std::size_t instants = 0;
  long postures = 0;  ///< that were computed
  /// Least distances of the postures that were looked at [m].
  double nearest_m = std::numeric_limits<double>::infinity(), nearest_stop_m = nearest_m;
};

/// Judges a plan without the planner: own kinematics from the rows of the arm's file, in double
/// precision, and another proof. Of the motion around a posture, with joints within ±δⱼ of it, ball
/// i moves at most Σⱼ Lᵢⱼ δⱼ, Lᵢⱼ the stretched length of the arm from axis j to the ball; what
/// that does not prove is halved. Proven are
///  - the streamed motion between all instants (cubic Hermite), `margin_m` apart from everything;
///  - the stop of each instant that leaves the path, `stop_margin_m` apart: all q + q̇ τ + s ρ(u), ρ
///    the ramp from q̇ with the arm's accelerations, 0 ≤ τ ≤ `stop_delay_s`, 0 ≤ s ≤ 1;
///  - the same with τ = 0 and one joint elsewhere, whose drive fails alone, for each joint: between
///    where it was in the last `stop_alone_s` and q + q̇ `stop_alone_s` + s ρ(u);
/// and checked are limits of joints, speeds and accelerations, rest at both ends, that velocities
/// are those of the positions, that motions join, and that each stop along the path is one: it
/// begins where the arm is, goes forward, ends at rest within the motion, and no harder than the
/// arm's accelerations allow.
/// @throws ConfigError if the plan does not fit the arm (PlanFile::check).
PlanVerdict verify_plan(const PlanFile& plan, const kin::ArmModel& arm);

}  // namespace mimesis::tool
