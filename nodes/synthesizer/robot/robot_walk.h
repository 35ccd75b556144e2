#pragma once

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
  RobotWalk(const RobotLimits& limits, double tolerance_m, double give_up_s, double dt_s);

  void place(const Eigen::Vector2d& p_W_m, double heading_rad);
  void walk_to(const Eigen::Vector2d& goal_W_m);
  void stop();
  /// Turns on the spot to this heading, and then stands.
  void turn_to(double heading_rad);
  /// Goes on at this speed, and turns to this heading meanwhile; below 1 cm/s it stands.
  void go_on(double forward_m_s, double heading_rad);

  void step(const RobotFeedback* feedback);

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
  enum class Task { none, go, turn, on };
  void see(const RobotFeedback* feedback);
  void decide(bool robot_stands);
  Eigen::Vector3d wished() const;

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
