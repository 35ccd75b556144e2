#pragma once
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "common/math/circle.h"
#include "nodes/synthesizer/robot/robot_feedback.h"

namespace mimesis::synthesizer {

/// Limits of requests to a robot. Defaults: below the limits of biped.urdf's pattern generator.
struct RobotLimits {
  double forward_m_s = 0.30, left_m_s = 0.10, turn_rad_s = 0.15;
  double acceleration_m_s2 = 0.25, turn_acceleration_rad_s2 = 0.25;
  double step_s = 0.8;  ///< duration of one step
};

/// Leads a robot to a goal by velocities of its pelvis, from its reported place; without feedback,
/// from the place where it would be if it had obeyed.
///
/// Far from the goal it turns to it, ψ̇ = k sin(ψ_goal − ψ) [M18 eq. 3.24], and goes forward the
/// slower, the more the goal lies aside; within 0.4 m it keeps its heading and goes straight to the
/// goal, forward and sideways, v = k·(remaining distance). No allocation.
class RobotWalk {
 public:
  RobotWalk(const RobotLimits& limits, double tolerance_m, double give_up_s, double dt_s)
      : limits_(limits),
        tolerance_m_(tolerance_m),
        give_up_s_(give_up_s),
        dt_s_(dt_s),
        clock_(limits.step_s, dt_s) {}

  void place(const Eigen::Vector2d& p_W_m, double heading_rad) {
    p_ = p_W_m;
    heading_ = heading_rad;
  }
  void walk_to(const Eigen::Vector2d& goal_W_m) {
    if (task_ != Task::go || goal_W_m != goal_) {
      reached_ = false;
      no_nearer_s_ = 0.0;
      nearest_m_ = std::numeric_limits<double>::infinity();
    }
    task_ = Task::go;
    goal_ = goal_W_m;
  }
  void stop() {
    task_ = Task::none;
    reached_ = false;
    distance_m_ = no_nearer_s_ = 0.0;
  }
  /// Turns on the spot to this heading, and then stands.
  void turn_to(double heading_rad) {
    task_ = Task::turn;
    goal_heading_ = heading_rad;
    reached_ = false;
    distance_m_ = no_nearer_s_ = 0.0;
  }
  /// Goes on at this speed, and turns to this heading meanwhile; below 1 cm/s it stands.
  void go_on(double forward_m_s, double heading_rad) {
    task_ = Task::on;
    forward_m_s_ = std::clamp(forward_m_s, 0.0, limits_.forward_m_s);
    goal_heading_ = heading_rad;
    reached_ = false;
    distance_m_ = no_nearer_s_ = 0.0;
  }

  void step(const RobotFeedback* feedback) {
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

  const Eigen::Vector2d& position_W_m() const { return p_; }
  double heading_rad() const { return heading_; }
  /// Wished: forward, left [m/s], turn to the left [rad/s].
  const Eigen::Vector3d& velocity() const { return v_; }
  bool stands() const { return !walk_; }  ///< steps shall end
  bool reached() const { return reached_; }
  double distance_m() const { return distance_m_; }
  bool stuck() const { return no_nearer_s_ > give_up_s_; }
  const GaitClock& clock() const { return clock_; }

 private:
  static constexpr double kNear_m = 0.4;  // from here on without turning
  static constexpr double kGo_1_s = 0.8, kTurn_1_s = 0.8;
  static constexpr double kAhead = 0.2, kAside = 0.8;  // rad: full speed below, none above
  static constexpr double kThereShare = 0.4;           // share of the tolerance: steps shall end
  static constexpr double kFaced_rad = 0.03;
  static constexpr double kNearer_m = 0.1;
  static constexpr double kStill = 1e-3;
  static constexpr double kCrawl_m_s = 0.01;
  static double towards(double now, double wished, double most) {
    return now + std::clamp(wished - now, -most, most);
  }

  enum class Task { none, go, turn, on };
  void see(const RobotFeedback* feedback) {
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
  /// Whether to step. A walking robot continues until it is well within the tolerance; a standing
  /// one begins if it is outside.
  void decide(bool robot_stands) {
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
  Eigen::Vector3d wished() const {
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

  RobotLimits limits_;
  double tolerance_m_, give_up_s_, dt_s_;
  GaitClock clock_;
  Task task_ = Task::none;
  Eigen::Vector2d goal_ = Eigen::Vector2d::Zero(), p_ = Eigen::Vector2d::Zero();
  double goal_heading_ = 0.0, heading_ = 0.0, forward_m_s_ = 0.0;
  Eigen::Vector3d v_ = Eigen::Vector3d::Zero();
  bool walk_ = false, reached_ = false;
  double distance_m_ = 0.0, nearest_m_ = 0.0, no_nearer_s_ = 0.0;
};

}  // namespace mimesis::synthesizer
