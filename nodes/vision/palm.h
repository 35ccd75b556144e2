#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>

#include "nodes/vision/blob_tracker.h"

namespace mimesis::vision {

/// The hand proper within the skin-coloured blob, without the forearm.
struct Palm {
  Eigen::Vector2d tip = Eigen::Vector2d::Zero();  ///< foremost point along the arm [px]
  Eigen::Vector2d center =
      Eigen::Vector2d::Zero();  ///< centroid of what lies within a hand's length of it [px]
};

/// Finds the hand at the end of an arm: along the blob's major axis, at the end that points towards
/// `reach`, the part within `length_px` of the foremost pixel. Nothing if no pixel is there.
/// @param reach     direction in the picture away from the teacher's body
std::optional<Palm> find_palm(std::span<const Run> runs, const Blob& blob,
                              const Eigen::Vector2d& reach, double length_px);

/// Angle of the palm's normal against the vertical [rad], 0 = from above, π/2 = from the side. A
/// palm faces what it grasps, so this is the direction from its centre to the object's. One view
/// shows two components of it; where they are shorter than `clearance_m`, the rest points along the
/// line of sight, since palm and object cannot fill the same space. Frame T [m].
/// @param clearance_m least distance of the centres of palm and object
double palm_angle(const Eigen::Vector2d& palm_m, const Eigen::Vector2d& object_m,
                  double clearance_m);

}  // namespace mimesis::vision
