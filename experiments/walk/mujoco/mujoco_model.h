#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "hw/sim/body/body_world.h"

namespace mimesis::walk {

/// A biped and the ground in MuJoCo's language, and where in a row of measures (engine.mjs) what
/// is found.
struct MujocoModel {
  std::string xml;
  std::vector<hw::sim::MotorModel> motors;
  /// Joints whose motors are springs, in the order of the actuators, and those that are servos, in
  /// the order of the equalities.
  std::vector<int> springs, servos;
  /// Number of each link's body, without the world's: frames of a robot's file hang where they do.
  std::vector<std::size_t> body;

  static constexpr Eigen::Index kPose = 7;     ///< position, quaternion w x y z
  static constexpr Eigen::Index kContact = 9;  ///< force, torque, point that both are about; in W
  /// First number of: positions, velocities, torques of springs (dof each); poses of all links;
  /// velocity of the IMU's link, in W; CoM and its velocity; contacts of the soles;
  /// torques of the servos. End: numbers in a row.
  Eigen::Index q, dq, torque, poses, imu, com, contacts, servo_torque, end;
};

/// The robot of the tree: masses, joints, limits; soles as boxes; motors and ground as in
/// BodyWorld. It starts half-sitting, square on the ground.
MujocoModel make_mujoco_model(const robot::Biped& biped, const hw::sim::BodyOptions& options);

}  // namespace mimesis::walk
