#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <string>
#include <tl/expected.hpp>

#include "common/error.h"
#include "common/motion/mocap/body.h"

namespace mimesis::mocap {

/// Which joint of a file's skeleton moves which joint of the figure.
struct BodyMap {
  /// By body joint, the name in the file. Joints between two of them are composed into the outer.
  /// Two body joints may be the same one of the file: a trunk or a neck without a joint of its own.
  std::array<std::string, kBodyJoints> joints;
  std::array<std::string, 2> toes;  ///< joint at the ball of the foot, or end ("LeftFoot_end")
  /// By body joint: which of the file joint's axes (in the project's order: x forward, y left, z up
  /// in the file's zero posture) point forward, left and up in the T-posture: "+x+y+z".
  /// Limbs that are then not yet as in the T-posture are straightened by the smallest rotation.
  std::array<std::string, kBodyJoints> axes;
  /// Elevation of the line from the ankle to the ball of the foot when the sole is flat [rad].
  double sole_rad = 0.0;
};

/// Skeletons whose soles were measured over many clips: CMU as BVH and as ASF, Bandai-Namco.
std::span<const BodyMap> known_body_maps();

/// The map of a skeleton of any names. Legs and arms are the pairs of branches with the same
/// lengths; names help to tell legs from arms, knees, elbows, heads and the sides, behind any
/// prefix. Where names do not tell the sides, the left is left of the direction of the feet. The
/// axes are all the same if the zero posture stands; else each joint's follow from the motion:
/// from the bone, from the axis about which knees and elbows bend, or from the mean posture
/// relative to the joint before. The sole is as in the slowest third of the frames. A known
/// skeleton gives its known map.
/// Status: why it is no upright person's, in one line.
tl::expected<BodyMap, Status> find_body_map(const Clip& clip);

/// Refuses a map that does not fit: joints that are not there or not below one another, axes that
/// are none. @throws ConfigError "clip: joint ... of the map (lknee), expected ..."
void check_body_map(const Clip& clip, const BodyMap& map);

/// Standing height of a skeleton, from the lengths of legs and trunk, within a tenth; in the unit
/// of its offsets [m].
double stature_m(const Skeleton& skeleton, const BodyMap& map);

/// The axis of the clip's world that points up, ±x, ±y or ±z: that along which legs and trunk
/// stand. z if they stand along none.
Eigen::Vector3d upward(const Clip& clip, const BodyMap& map);

/// Ball of the foot in the ankle's frame, zero posture [m].
Eigen::Vector3d ball_of_foot(const Clip& clip, const BodyMap& map, Side side);

/// The motion of the 17-joint figure. Angles are counted from the T-posture: standing upright, legs
/// down, feet flat and forward, arms sideways [M18 3.3.2]. Segments are the file's; one that spans
/// a joint which the figure lacks (the collar bone) takes its mean over the clip. The toe point is
/// on the ground 4 cm under the ball of the foot; the heel point, which no file has, is as low with
/// a flat sole, and as far behind the ankle as 0.3 of the ball's distance before it. Where the file
/// has no hand or head end: 0.65 of the forearm, 0.46 of the thigh. Up to three first frames that
/// are no part of the motion, because the figure leaps out of them (the T-posture that the CMU
/// conversion puts there), are left out; `first_frame` tells.
/// @throws ConfigError as check_body_map(); if the clip has no frame
BodyClip to_body(const Clip& clip, const BodyMap& map);
/// With the map that is found. @throws ConfigError as find_body_map() tells
BodyClip to_body(const Clip& clip);

}  // namespace mimesis::mocap
