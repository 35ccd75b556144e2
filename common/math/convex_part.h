#pragma once
#include <Eigen/Geometry>
#include <limits>

namespace mimesis::math {

/// All that is within `radius` of the convex hull of points: a ball has one point, a capsule two.
struct ConvexPart {
  Eigen::MatrixX3d points;  ///< a row each, at least one [m]
  double radius = 0.0;      ///< [m]
};

/// The ball around a part's box.
struct RoundBound {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double radius = 0.0;  ///< with the part's own
};
RoundBound round_bound(const ConvexPart& part);

/// Bounds of the distance between two parts [m]. Where their hulls meet both are minus the radii.
struct Gap {
  double at_least = -std::numeric_limits<double>::infinity();
  double at_most = std::numeric_limits<double>::infinity();
};

/// Distance of part b, at X_AB, from part a by the algorithm of Gilbert, Johnson and Keerthi (IEEE
/// J. Robotics and Automation 4(2), 1988). `at_least` is the distance of two planes between the
/// parts, so it holds whatever the search does. It ends when the gap is known to be below `near`,
/// between `near` and `far`, or at least `far`; or to a micrometre.
/// @param from_b  where to begin: a direction in A, from b to a, in which the parts were apart
///                before; becomes that of now. Zero: none
Gap gap_between(const ConvexPart& a, const ConvexPart& b, const Eigen::Isometry3d& X_AB,
                double near, double far, Eigen::Vector3d& from_b);
Gap gap_between(const ConvexPart& a, const ConvexPart& b, const Eigen::Isometry3d& X_AB,
                double near, double far);
/// To a micrometre.
Gap gap_between(const ConvexPart& a, const ConvexPart& b, const Eigen::Isometry3d& X_AB);

}  // namespace mimesis::math
