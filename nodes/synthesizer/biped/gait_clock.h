#pragma once
#include "nodes/synthesizer/biped/robot_feedback.h"

namespace mimesis::synthesizer {

/// Phase of the gait cycle of a robot whose steps take a fixed time: 0 when its left foot lands, π
/// when its right one does. It is drawn to where the feedback says that the robot is,
///   φ̇ = π/T + clamp(k (φ_robot − φ)), k = 10 1/s,
/// never runs backwards, and stands while the robot stands. Without feedback it runs by itself as
/// long as steps are wished, and ends with the end of a step.
class GaitClock {
 public:
  /// @param step_s  T, of one step
  GaitClock(double step_s, double dt_s) : step_s_(step_s), dt_s_(dt_s) {}

  /// @param feedback  null: none
  /// @param walk  steps are wished
  void step(const RobotFeedback* feedback, bool walk);

  double phase_rad() const { return phase_rad_; }  ///< [0, 2π)
  double rate_rad_s() const { return rate_rad_s_; }
  bool moves() const { return moves_; }  ///< the robot steps, as far as is known
  /// Of the step under way, [0, step_s]; what a robot on this clock would report.
  double to_landing_s() const;
  mocap::Side swing() const { return phase_rad_ < half() ? mocap::kRight : mocap::kLeft; }
  /// The foot that landed in the last step of time, by this clock.
  bool left_landed() const { return left_landed_; }
  bool right_landed() const { return right_landed_; }

 private:
  static double half();
  double wished_rate(const RobotFeedback* feedback, bool walk);

  double step_s_, dt_s_;
  double phase_rad_ = 0.0, rate_rad_s_ = 0.0;
  bool moves_ = false, left_landed_ = false, right_landed_ = false;
};

}  // namespace mimesis::synthesizer
