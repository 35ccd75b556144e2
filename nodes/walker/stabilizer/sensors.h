#pragma once
#include <Eigen/Geometry>
#include <array>

#include "common/robot/dynamics.h"

namespace mimesis::walker {

/// What a robot measures at one tick. W of the IMU has its z up and the heading of its start.
struct Sensors {
  Eigen::VectorXd q, dq;                                       ///< dof; encoders
  Eigen::Quaterniond R_WI = Eigen::Quaterniond::Identity();    ///< attitude of the IMU link
  Eigen::Vector3d gyro_I = Eigen::Vector3d::Zero();            ///< [rad/s] in the IMU link
  Eigen::Vector3d specific_force_I = Eigen::Vector3d::Zero();  ///< [m/s²], +g up when at rest
  /// On the soles about their origins, in S; averaged over the tick.
  std::array<robot::Wrench, 2> foot_S;
};

}  // namespace mimesis::walker
