#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>

namespace mimesis::robot {

/// A joint's axis as a line in space.
struct Line {
  Eigen::Vector3d point, direction;  ///< [m]; unit vector
};

/// The point that all lines go through within `tolerance_m`; nothing if there is none or all lines
/// are parallel.
std::optional<Eigen::Vector3d> meeting_point(std::span<const Line> lines,
                                             double tolerance_m = 1e-6);

}  // namespace mimesis::robot
