#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "common/kin/table.h"

namespace mimesis::world {

/// Solid cylinder about the z axis of its own frame O, whose origin is the centre.
struct Cylinder {
  Eigen::Isometry3d X_WO = Eigen::Isometry3d::Identity();
  double radius = 0.0;  ///< [m]
  double height = 0.0;  ///< [m]
};

/// Distance of point `p` from the surface, negative inside [m].
double signed_distance(const kin::Box& box, const Eigen::Vector3d& p);
double signed_distance(const Cylinder& cylinder, const Eigen::Vector3d& p);

/// Angle between the cylinder's axis and the vertical, [0, π/2] [rad].
double tilt(const Cylinder& cylinder);

/// Height of the lowest point: z − ½h cos θ − r sin θ at tilt θ [m].
double lowest_point(const Cylinder& cylinder);

/// Balls inside the cylinder that touch its surface: five along the axis, and points (radius 0),
/// twelve on each rim. A flat face that touches none of them cuts the rims by less than r·(1 − cos
/// 15°).
std::vector<kin::Ball> covering_balls(const Cylinder& cylinder);

}  // namespace mimesis::world
