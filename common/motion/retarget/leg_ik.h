#pragma once
#include <Eigen/Core>

namespace mimesis::retarget {

/// A limb of two segments with a hinge-like middle joint: thigh and shank.
struct TwoSegments {
  Eigen::Vector3d upper_m, lower_m;  ///< knee in the hip's frame, ankle in the knee's frame
};

/// Orientations in W that put the end of a limb to a place.
struct LimbPosture {
  Eigen::Matrix3d R_upper, R_lower;
  /// How far the end stays from its goal [m]; zero unless the limb is too short (or folded).
  double miss_m = 0.0;
};

/// Moves the ankle to `goal_W`, the hip being at `hip_W`, starting from orientations in W that it
/// changes as little as needed: the middle joint bends in the plane in which it is bent now
/// (towards its y axis if it is straight), then the limb turns as a whole by the smallest rotation.
/// A knee bends forward (positive about y). Closed form; does not allocate.
LimbPosture reach(const TwoSegments& limb, const Eigen::Matrix3d& R_upper,
                  const Eigen::Matrix3d& R_lower, const Eigen::Vector3d& hip_W,
                  const Eigen::Vector3d& goal_W);

}  // namespace mimesis::retarget
