#pragma once
#include <span>
#include <vector>

#include "common/kin/arm.h"

namespace mimesis::kin {

/// Axis of a joint at q = 0: a point on it and its direction, a unit vector.
struct JointAxis {
  Eigen::Vector3d point, direction;
  bool slides = false;  ///< along it, instead of turning about it
};

/// Any chain of joints in standard Denavit-Hartenberg form: frame i lies on axis i + 1, its
/// x axis along the common normal of axes i and i + 1.
struct DhRows {
  std::vector<DhLink> links;
  std::vector<Eigen::Isometry3d> frames;  ///< 0 .. n at q = 0, in the frame of the axes
};
DhRows dh_rows(std::span<const JointAxis> axes);

}  // namespace mimesis::kin
