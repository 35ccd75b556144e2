#pragma once
#include <Eigen/Geometry>
#include <array>
#include <numbers>
#include <optional>

#include "common/motion/mocap/body.h"

namespace mimesis::synthesizer {

/// A sole on the ground: the point below the ankle, and where the toes point.
struct SolePrint {
  mocap::Side side = mocap::kLeft;
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;
};

enum class RobotGait { waiting, standing, starting, walking, stopping, safe };

/// Estimated place and plan of a walking robot: feedback to the node that wishes its motion [M18
/// 3.8.1].
struct RobotFeedback {
  RobotGait gait = RobotGait::standing;
  Eigen::Vector3d pelvis_W_m = Eigen::Vector3d::Zero();
  double heading_rad = 0.0;           ///< heading of the pelvis in W
  mocap::Side swing = mocap::kRight;  ///< foot that moves, or will next
  double to_landing_s = 0.0;          ///< 0 while standing
  SolePrint landing;                  ///< planned
  std::array<SolePrint, 2> feet;      ///< where they are now: left, right
  int steps = 0;                      ///< landed since the start
  bool hands_known = false;           ///< by the encoders, as the head
  std::array<Eigen::Vector3d, 2> hand_W_m{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  std::optional<Eigen::Isometry3d> X_WH = {};  ///< link of the head

  bool moves() const {
    return gait == RobotGait::starting || gait == RobotGait::walking || gait == RobotGait::stopping;
  }
};

/// Phase of the gait cycle of a robot whose steps take a fixed time: 0 when its left foot lands, π
/// when its right one does. It is pulled towards the phase in the feedback,
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
  /// Time to the landing of the current step, [0, step_s]; a robot on this clock would report it.
  double to_landing_s() const;
  mocap::Side swing() const { return phase_rad_ < std::numbers::pi ? mocap::kRight : mocap::kLeft; }

 private:
  double wished_rate(const RobotFeedback* feedback, bool walk);

  double step_s_, dt_s_;
  double phase_rad_ = 0.0, rate_rad_s_ = 0.0;
  bool moves_ = false;
};

/// Landings that are wished: of the next swing foot and the one after it.
using Landings = std::array<std::optional<SolePrint>, 2>;

/// A robot that walks exactly as wished: assumed while there is no feedback. Shifts its weight
/// first, then a step every `step_s`, as long as landings are wished; the middle of the feet
/// carries the pelvis.
class BelievedRobot {
 public:
  BelievedRobot(double step_s, double shift_s, double dt_s)
      : step_s_(step_s), shift_s_(shift_s), dt_s_(dt_s) {}

  /// It continues from here.
  void place(const RobotFeedback& robot);
  /// @param walk  steps are wished; else it ends with the step under way
  void step(const Landings& landing, bool walk);
  const RobotFeedback& feedback() const { return robot_; }

 private:
  void land();

  double step_s_, shift_s_, dt_s_;
  RobotFeedback robot_;
  Eigen::Vector2d lifted_ = Eigen::Vector2d::Zero();  // where the swing foot left
};

/// Two feet side by side, `distance_m` apart, heading the way; pelvis above their middle.
RobotFeedback standing_robot(const Eigen::Vector2d& p_W_m, double heading_rad, double distance_m,
                             double pelvis_height_m);

}  // namespace mimesis::synthesizer
