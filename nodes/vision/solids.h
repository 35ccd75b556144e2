#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/image/rig.h"

namespace mimesis::vision {

/// A rigid convex body: points whose hull it is, relative to its centre [m].
using Body = std::vector<Eigen::Vector3d>;

/// Upright cylinder: 16 points on each rim.
Body cylinder(double radius_m, double height_m);
/// Box with the given edges along x, y, z.
Body box(double width_m, double height_m, double depth_m);

/// What a camera sees of a body: area [px²], centroid [px] and central second moments [px²] of the
/// convex hull of the projected points.
struct Outline {
  double area = 0.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
};

/// Outline of a body whose centre is at `center_T` [m]. Its centroid differs from the image of the
/// centre, since near parts look larger. Precondition: all of it is before the camera.
Outline outline(const image::Camera& camera, const Body& body, const Eigen::Vector3d& center_T);

/// Centre (x, y) in the plane of motion z = 0 [m] of a body whose outline has its centroid at
/// `pixel`. Fixed-point iteration, exact to 0.01 mm; nothing if the pixel looks past the plane.
std::optional<Eigen::Vector2d> locate(const image::Camera& camera, const Body& body,
                                      const Eigen::Vector2d& pixel);

/// Forms that things on the table may have.
enum class Form {
  cylinder,  ///< upright
  block,     ///< upright, square, edges along x and z
  bar,       ///< lying
};

/// A thing on the table, frame T [m].
struct Solid {
  Form form = Form::cylinder;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double half_width = 0.0;  ///< radius; half the edge; half the thickness of a bar
  double length = 0.0;      ///< height; span of a bar
  double yaw_rad = 0.0;     ///< of a bar: its axis is (cos, 0, -sin) of it, (-π/2, π/2]
  double aspect = 1.0;      ///< of a bar: width over thickness [1]

  Body body() const;
  double top() const { return center.y() + (form == Form::bar ? half_width : 0.5 * length); }
  double bottom() const { return 2.0 * center.y() - top(); }
};

/// A solid found in two pictures.
struct FoundSolid {
  Solid solid;
  Eigen::Matrix3d covariance_m2 = Eigen::Matrix3d::Zero();  ///< of the centre
  double misfit = 0.0;  ///< rms of what is left over, in standard deviations [1]
};

/// The solid whose outlines in two cameras come nearest to those seen: place, sizes and direction
/// by least squares (Levenberg & Marquardt) over areas, centroids and second moments. Edges of
/// regions are uncertain by 0.3 px outwards or inwards, which says little of sizes and less of
/// places.
/// @param form       with the aspect of a bar; the rest is found
/// @param centroid_px  standard deviation of the centroids seen
/// @returns nothing if the rays do not meet before the cameras, or no solid comes near.
std::optional<FoundSolid> fit_solid(const Solid& form, std::span<const image::Camera> cameras,
                                    std::span<const Outline> seen, double centroid_px);

}  // namespace mimesis::vision
