#include "nodes/synthesizer/robot_director.h"

#include <algorithm>

#include "common/math/circle.h"

namespace mimesis::synthesizer {

RobotDirector::RobotDirector(Walkers& walkers, const RobotLimits& limits, const WalkSettings& walk)
    : walkers_(walkers),
      step_s_(limits.step_s),
      walk_(limits, walk.goal_tolerance_m, walk.give_up_s, walk.dt_s) {
  const RootPose& root = walkers.state(0).root;
  walk_.place(root.position_W_m, root.heading_rad);
  move_character();  // its first posture
  const auto angles = walkers.angles(0);
  angles_.assign(angles.begin(), angles.end());
}

void RobotDirector::walk_to(const Eigen::Vector2d& goal_W_m) {
  kind_ = GoalKind::walk_to;
  walk_.walk_to(goal_W_m);
}

void RobotDirector::stop() {
  kind_ = GoalKind::stop;
  walk_.stop();
}

/// The character steps while the robot does, as long steps, in its rhythm.
void RobotDirector::move_character() {
  const GaitClock& clock = walk_.clock();
  const double length = step_s_ * walk_.velocity().head<2>().norm();
  walkers_.set_gait(0,
                    {.phase_rate_rad_s = math::kTwoPi / (2.0 * step_s_), .step_length_m = length},
                    clock.phase_rad());
  walkers_.walker(0).set_free(clock.moves());
  walkers_.step();
}

void RobotDirector::step(const RobotFeedback* feedback) {
  walk_.step(feedback);
  move_character();
  const WalkerState& state = walkers_.state(0);
  const auto angles = walkers_.angles(0);
  std::ranges::copy(angles, angles_.begin());
  motion_.phase_rad = state.phase_rad;
  motion_.phase_rate_rad_s = state.phase_rate_rad_s;
  motion_.velocity = walk_.velocity();
  motion_.pelvis_W_m << walk_.position_W_m(),
      feedback != nullptr ? feedback->pelvis_W_m.z() : state.root.height_m;
  motion_.heading_rad = walk_.heading_rad();
  motion_.support = walk_.clock().swing() == mocap::kLeft ? mocap::kRight : mocap::kLeft;
  motion_.stands = walk_.stands();
  const bool steps = walk_.clock().moves();
  motion_.action = walk_.stands() ? (steps ? "stop" : "stand") : (steps ? "walk" : "start");
}

Progress RobotDirector::progress() const {
  Progress p;
  p.kind = kind_;
  p.distance_m = walk_.distance_m();
  p.reached = kind_ == GoalKind::stop ? walk_.stands() && !walk_.clock().moves() : walk_.reached();
  if (walk_.stuck()) p.reason = "no nearer for a long time";
  return p;
}

}  // namespace mimesis::synthesizer
