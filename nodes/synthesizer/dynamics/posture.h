#pragma once
#include "nodes/synthesizer/dynamics/lanes.h"
#include "common/motion/mocap/body.h"

namespace mimesis::synthesizer {

/// Segment lengths of a body in float.
struct BodyLanes {
  explicit BodyLanes(const mocap::Body& body);
  Vec3 offset[mocap::kBodyJoints];  ///< joint centre in the parent's frame [m]
  Vec3 foot[4];                     ///< left heel, left toe, right heel, right toe in the ankles'
};

/// Points of 16 figures [m], three lanes each.
struct alignas(64) PointLanes {
  Lane joint[mocap::kBodyJoints][3];
  Lane foot[4][3];  ///< left heel, left toe, right heel, right toe
};

/// Rotations of all joints relative to the frame of the points, columns one after the other.
struct alignas(64) RotationLanes {
  Lane joint[mocap::kBodyJoints][9];
};

/// Forward kinematics of 16 figures with their pelvis at the origin: what mocap::forward_kinematics
/// computes for one. `angle`: kBodyRows lanes of axis-angle components [rad].
void posture(const BodyLanes& body, const Lane* angle, RotationLanes& rotation, PointLanes& point);

}  // namespace mimesis::synthesizer
