#include "nodes/synthesizer/robot/robot_feedback.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "nodes/synthesizer/character/smooth.h"

namespace mimesis::synthesizer {

namespace {
constexpr double kPull_1_s = 10.0;
constexpr double kNever = 0.9;  // share of the clock's rate that the pull may add or take
}  // namespace

double GaitClock::to_landing_s() const {
  return moves_ ? step_s_ * (1.0 - std::fmod(phase_rad_, std::numbers::pi) / std::numbers::pi)
                : 0.0;
}

double GaitClock::wished_rate(const RobotFeedback* feedback, bool walk) {
  const double rate = std::numbers::pi / step_s_;
  if (feedback == nullptr) {
    moves_ = moves_ || walk;
    return moves_ ? rate : 0.0;
  }
  moves_ = feedback->moves() && feedback->to_landing_s > 0.0;
  if (!moves_) return 0.0;
  const double start = feedback->swing == mocap::kRight ? 0.0 : std::numbers::pi;
  const double share = std::clamp(1.0 - feedback->to_landing_s / step_s_, 0.0, 1.0);
  const double off = math::wrap_pi(start + std::numbers::pi * share - phase_rad_);
  // before the first step the weight is shifted: the clock waits where the step begins
  const double own = feedback->to_landing_s > step_s_ ? 0.0 : rate;
  return std::max(0.0, own + std::clamp(kPull_1_s * off, -kNever * rate, kNever * rate));
}

void GaitClock::step(const RobotFeedback* feedback, bool walk) {
  rate_rad_s_ = wished_rate(feedback, walk);
  const double before = phase_rad_;
  phase_rad_ += dt_s_ * rate_rad_s_;
  const bool right_lands = before < std::numbers::pi && phase_rad_ >= std::numbers::pi;
  const bool left_lands = phase_rad_ >= math::kTwoPi;
  if (left_lands) phase_rad_ -= math::kTwoPi;
  if (feedback == nullptr && !walk && (left_lands || right_lands)) moves_ = false;
}

void BelievedRobot::place(const RobotFeedback& robot) {
  robot_ = robot;
  lifted_ = robot.feet[robot.swing].p_W_m;
}

void BelievedRobot::land() {
  SolePrint& foot = robot_.feet[robot_.swing];
  foot.p_W_m = robot_.landing.p_W_m;
  foot.yaw_rad = robot_.landing.yaw_rad;
  robot_.swing = robot_.swing == mocap::kLeft ? mocap::kRight : mocap::kLeft;
  lifted_ = robot_.feet[robot_.swing].p_W_m;
  ++robot_.steps;
}

void BelievedRobot::step(const Landings& landing, bool walk) {
  if (!robot_.moves()) {
    if (!walk || !landing[0]) return;
    robot_.gait = RobotGait::starting;
    robot_.swing = landing[0]->side;
    lifted_ = robot_.feet[robot_.swing].p_W_m;
    robot_.to_landing_s = step_s_ + shift_s_;
  }
  const auto wished =
      std::ranges::find_if(landing, [&](const auto& l) { return l && l->side == robot_.swing; });
  robot_.landing = wished != landing.end() ? **wished : robot_.feet[robot_.swing];
  robot_.landing.side = robot_.swing;
  robot_.to_landing_s -= dt_s_;
  if (robot_.to_landing_s < step_s_) robot_.gait = RobotGait::walking;
  if (robot_.to_landing_s <= 1e-9) {
    land();
    const bool more = walk && landing[1] && landing[1]->side == robot_.swing;
    robot_.gait = more ? RobotGait::walking : RobotGait::standing;
    robot_.to_landing_s = more ? step_s_ : 0.0;
  } else {
    const double in = minimum_jerk(1.0 - robot_.to_landing_s / step_s_, 0.125, 1.0);
    robot_.feet[robot_.swing].p_W_m = lifted_ + in * (robot_.landing.p_W_m - lifted_);
  }
  const SolePrint &left = robot_.feet[0], &right = robot_.feet[1];
  robot_.pelvis_W_m.head<2>() = 0.5 * (left.p_W_m + right.p_W_m);
  robot_.heading_rad = left.yaw_rad + 0.5 * math::wrap_pi(right.yaw_rad - left.yaw_rad);
}

RobotFeedback standing_robot(const Eigen::Vector2d& p_W_m, double heading_rad, double distance_m,
                             double pelvis_height_m) {
  RobotFeedback robot;
  robot.heading_rad = heading_rad;
  robot.pelvis_W_m << p_W_m, pelvis_height_m;
  const Eigen::Vector2d left(-std::sin(heading_rad), std::cos(heading_rad));
  for (const auto side : {mocap::kLeft, mocap::kRight}) {
    const double sign = side == mocap::kLeft ? 0.5 : -0.5;
    robot.feet[side] = {side, p_W_m + sign * distance_m * left, heading_rad};
  }
  return robot;
}

}  // namespace mimesis::synthesizer
