#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <string>

#include "common/motion/mocap/body.h"

namespace mimesis::mocap {

/// Which joint of a file's skeleton moves which joint of the figure.
struct BodyMap {
  std::string name;
  /// By body joint, the name in the file. Joints between two of them are composed into the outer.
  std::array<std::string, kBodyJoints> joints;
  std::array<std::string, 2> toes;  ///< joint at the ball of the foot
  /// By body joint: which of the file joint's axes (in the project's order: x forward, y left, z up
  /// in the file's zero posture) point forward, left and up in the T-posture. Empty: "+x+y+z".
  /// Limbs that are then not yet as in the T-posture are straightened by the smallest rotation.
  std::array<std::string, kBodyJoints> axes;
  /// Elevation of the line from the ankle to the ball of the foot when the sole is flat [rad].
  double sole_rad = 0.0;
};

/// Skeletons that to_body() knows: CMU as BVH and as ASF, Bandai-Namco.
std::span<const BodyMap> known_body_maps();

/// The motion of the 17-joint figure. Angles are counted from the T-posture: standing upright, legs
/// down, feet flat and forward, arms sideways [M18 3.3.2]. Segments are the file's; one that spans
/// a joint which the figure lacks (the collar bone) takes its mean over the clip. The toe point is
/// on the ground 4 cm under the ball of the foot; the heel point, which no file has, is as low with
/// a flat sole, and as far behind the ankle as 0.3 of the ball's distance before it. Where the file
/// has no hand or head end: 0.65 of the forearm, 0.46 of the thigh. Up to three first frames that
/// are no part of the motion, because the figure leaps out of them (the T-posture that the CMU
/// conversion puts there), are left out; `first_frame` tells.
/// @throws ConfigError with the names of missing joints; if the clip has no frame
BodyClip to_body(const Clip& clip);

}  // namespace mimesis::mocap
