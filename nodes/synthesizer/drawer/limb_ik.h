#pragma once
#include <Eigen/Core>
#include <array>

#include "common/motion/mocap/body.h"

namespace mimesis::synthesizer {

/// Where a foot is. The sole is at z = 0 if pitch is zero and the ankle at its height.
struct FootPose {
  Eigen::Vector3d p_W_ankle = Eigen::Vector3d::Zero();  ///< [m]
  double yaw_rad = 0.0;                                 ///< toes out to the left: +
  double pitch_rad = 0.0;                               ///< about y: + toes down
};

/// Axis-angle vectors of the three joints of a limb, from the trunk outwards, and how much too far
/// the target was (0 if it was reached; the limb points to it, stretched, otherwise).
struct LimbAngles {
  std::array<Eigen::Vector3d, 3> axis_angle_rad;
  double short_by_m = 0.0;
};

/// Hip, knee and ankle that put the ankle at `p_W_ankle` and the foot at `R_W_foot`: two links in
/// closed form. The knee is a hinge about y and bends to where pelvis and toes point. Needs offsets
/// of knee and ankle along −z, as standard_body() has them.
LimbAngles leg_angles(const mocap::Body& body, mocap::Side side, const Eigen::Matrix3d& R_W_root,
                      const Eigen::Vector3d& p_W_root, const Eigen::Vector3d& p_W_ankle,
                      const Eigen::Matrix3d& R_W_foot);

/// Shoulder, elbow and wrist (straight) that put the finger tips at `p_W_hand`. The elbow is a
/// hinge about z and points to `elbow_W` as far as the target allows. Needs offsets of elbow, wrist
/// and hand along ±y.
LimbAngles arm_angles(const mocap::Body& body, mocap::Side side, const Eigen::Matrix3d& R_W_chest,
                      const Eigen::Vector3d& p_W_shoulder, const Eigen::Vector3d& p_W_hand,
                      const Eigen::Vector3d& elbow_W);

Eigen::Matrix3d foot_rotation(const FootPose& foot);

}  // namespace mimesis::synthesizer
