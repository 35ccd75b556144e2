#include "nodes/synthesizer/robot/robot_walk.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kNear_m = 0.4;  // from here on without turning
constexpr double kGo_1_s = 0.8, kTurn_1_s = 0.8;
constexpr double kAhead = 0.2, kAside = 0.8;  // rad: full speed below, none above
constexpr double kThereShare = 0.4;           // share of the tolerance: steps shall end
constexpr double kFaced_rad = 0.03;
constexpr double kNearer_m = 0.1;
constexpr double kStill = 1e-3;
constexpr double kCrawl_m_s = 0.01;

double towards(double now, double wished, double most) {
  return now + std::clamp(wished - now, -most, most);
}

}  // namespace

RobotWalk::RobotWalk(const RobotLimits& limits, double tolerance_m, double give_up_s, double dt_s)
    : limits_(limits),
      tolerance_m_(tolerance_m),
      give_up_s_(give_up_s),
      dt_s_(dt_s),
      clock_(limits.step_s, dt_s) {}

void RobotWalk::place(const Eigen::Vector2d& p_W_m, double heading_rad) {
  p_ = p_W_m;
  heading_ = heading_rad;
}

void RobotWalk::walk_to(const Eigen::Vector2d& goal_W_m) {
  if (task_ != Task::go || goal_W_m != goal_) {
    reached_ = false;
    no_nearer_s_ = 0.0;
    nearest_m_ = std::numeric_limits<double>::infinity();
  }
  task_ = Task::go;
  goal_ = goal_W_m;
}

void RobotWalk::turn_to(double heading_rad) {
  task_ = Task::turn;
  goal_heading_ = heading_rad;
  reached_ = false;
  distance_m_ = no_nearer_s_ = 0.0;
}

void RobotWalk::go_on(double forward_m_s, double heading_rad) {
  task_ = Task::on;
  forward_m_s_ = std::clamp(forward_m_s, 0.0, limits_.forward_m_s);
  goal_heading_ = heading_rad;
  reached_ = false;
  distance_m_ = no_nearer_s_ = 0.0;
}

void RobotWalk::stop() {
  task_ = Task::none;
  reached_ = false;
  distance_m_ = no_nearer_s_ = 0.0;
}

void RobotWalk::see(const RobotFeedback* feedback) {
  if (feedback != nullptr) {
    p_ = feedback->pelvis_W_m.head<2>();
    heading_ = feedback->heading_rad;
  } else {
    const double c = std::cos(heading_), s = std::sin(heading_);
    p_ += dt_s_ * Eigen::Vector2d(c * v_[0] - s * v_[1], s * v_[0] + c * v_[1]);
    heading_ = math::wrap_pi(heading_ + dt_s_ * v_[2]);
  }
  if (task_ != Task::go) return;
  distance_m_ = (goal_ - p_).norm();
  if (distance_m_ < nearest_m_ - kNearer_m || reached_) {
    nearest_m_ = distance_m_;
    no_nearer_s_ = 0.0;
  } else {
    no_nearer_s_ += dt_s_;
  }
}

/// Whether to step. A walking robot continues until it is well within the tolerance; a standing one
/// begins if it is outside.
void RobotWalk::decide(bool robot_stands) {
  switch (task_) {
    case Task::none:
      walk_ = false;
      return;
    case Task::turn: {
      const double left = std::abs(math::wrap_pi(goal_heading_ - heading_));
      walk_ = walk_ ? left > kFaced_rad : robot_stands && left > 2.0 * kFaced_rad;
      reached_ = robot_stands && !walk_;
      return;
    }
    case Task::on:
      walk_ = forward_m_s_ > kCrawl_m_s;
      return;
    case Task::go:
      walk_ = walk_ ? distance_m_ > kThereShare * tolerance_m_
                    : robot_stands && distance_m_ > tolerance_m_;
      reached_ = robot_stands && !walk_;
  }
}

Eigen::Vector3d RobotWalk::wished() const {
  if (!walk_) return Eigen::Vector3d::Zero();
  const auto turn = [this](double aside) {
    const double pull =
        std::abs(aside) > 0.5 * std::numbers::pi ? std::copysign(1.0, aside) : std::sin(aside);
    return std::clamp(kTurn_1_s * pull, -limits_.turn_rad_s, limits_.turn_rad_s);
  };
  const double heading_left = math::wrap_pi(goal_heading_ - heading_);
  if (task_ == Task::turn) return {0.0, 0.0, turn(heading_left)};
  if (task_ == Task::on) return {forward_m_s_, 0.0, turn(heading_left)};
  const double c = std::cos(heading_), s = std::sin(heading_);
  const Eigen::Vector2d to = goal_ - p_;
  const Eigen::Vector2d to_H(c * to.x() + s * to.y(), c * to.y() - s * to.x());
  if (distance_m_ < kNear_m) {
    return {std::clamp(kGo_1_s * to_H.x(), -limits_.left_m_s, limits_.forward_m_s),
            std::clamp(kGo_1_s * to_H.y(), -limits_.left_m_s, limits_.left_m_s), 0.0};
  }
  const double aside = std::atan2(to_H.y(), to_H.x());
  const double ahead = std::clamp((kAside - std::abs(aside)) / (kAside - kAhead), 0.0, 1.0);
  const double forward = std::min(limits_.forward_m_s, kGo_1_s * distance_m_);
  return {ahead * forward, 0.0, turn(aside)};
}

void RobotWalk::step(const RobotFeedback* feedback) {
  see(feedback);
  const bool rests = v_.cwiseAbs().maxCoeff() < kStill;
  decide(feedback != nullptr ? feedback->gait == RobotGait::standing : rests && !clock_.moves());
  const Eigen::Vector3d to = wished();
  const double most = limits_.acceleration_m_s2 * dt_s_;
  v_[0] = towards(v_[0], to[0], most);
  v_[1] = towards(v_[1], to[1], most);
  v_[2] = towards(v_[2], to[2], limits_.turn_acceleration_rad_s2 * dt_s_);
  clock_.step(feedback, walk_ || (feedback == nullptr && !rests));
}

}  // namespace mimesis::synthesizer
