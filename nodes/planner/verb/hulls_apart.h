#pragma once
#include <Eigen/Geometry>

namespace mimesis::tool {

/// Bounds of the distance of two hulls, corners a column each [m].
struct Apart {
  double at_least = 0.0;  ///< of two planes between them
  double at_most = 0.0;   ///< of two points in them
};

/// By the point of least norm in the hull of ever nearer corners of their difference, of which all
/// subsets are tried. It ends when the hulls are known to be `near` or nearer, or `far` or farther,
/// or to a micrometre.
/// @param normal  of the planes that were tried last, which are tried first
Apart hulls_apart(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b, double near, double far,
                  Eigen::Vector3d& normal);

}  // namespace mimesis::tool
