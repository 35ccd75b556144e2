#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "common/image/pinhole.h"

namespace mimesis::vision {

/// A rigid convex body in the plane of motion: points whose hull it is, relative to its centre [m].
using Body = std::vector<Eigen::Vector3d>;

/// Upright cylinder: 16 points on each rim.
Body cylinder(double radius_m, double height_m);
/// Box with the given edges along x, y, z.
Body box(double width_m, double height_m, double depth_m);

/// Centroid of the image of a body whose centre is at (x, y, 0) [px]: area centroid of the convex
/// hull of the projected points. It differs from the image of the centre, since near parts look
/// larger.
Eigen::Vector2d silhouette_centroid(const image::Pinhole& camera, const Body& body,
                                    const Eigen::Vector2d& center_m);

/// Inverse: centre (x, y) [m] of a body whose silhouette has its centroid at `pixel`. Fixed-point
/// iteration, exact to 0.01 mm; nothing if the pixel looks past the plane.
std::optional<Eigen::Vector2d> locate(const image::Pinhole& camera, const Body& body,
                                      const Eigen::Vector2d& pixel);

}  // namespace mimesis::vision
