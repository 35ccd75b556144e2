#pragma once
#include <Eigen/Core>
#include <array>

#include "common/motion/mocap/body.h"

namespace mimesis::synthesizer {

/// A sole on the ground: the point below the ankle, and where the toes point.
struct SolePrint {
  mocap::Side side = mocap::kLeft;
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero();
  double yaw_rad = 0.0;
};

enum class RobotGait { waiting, standing, starting, walking, stopping, safe };

/// Where a walking robot believes to be and what it plans: the feedback to whoever wishes its
/// motion [M18 3.8.1].
struct RobotFeedback {
  RobotGait gait = RobotGait::standing;
  Eigen::Vector3d pelvis_W_m = Eigen::Vector3d::Zero();
  double heading_rad = 0.0;           ///< of the pelvis in W
  mocap::Side swing = mocap::kRight;  ///< foot that moves, or will next
  double to_landing_s = 0.0;          ///< 0 while standing
  SolePrint landing;                  ///< planned
  std::array<SolePrint, 2> feet;      ///< where they are now: left, right
  int steps = 0;                      ///< landed since the start
  bool hands_known = false;
  std::array<Eigen::Vector3d, 2> hand_W_m{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};

  bool moves() const {
    return gait == RobotGait::starting || gait == RobotGait::walking || gait == RobotGait::stopping;
  }
};

}  // namespace mimesis::synthesizer
