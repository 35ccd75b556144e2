#pragma once
#include <Eigen/Geometry>
#include <cmath>

#include "experiments/motion/film.h"

namespace mimesis::synthesizer {

/// A FilmCamera at work. C: x right, y down, z forward. Pixels as in image::Image, times `zoom`.
class FilmView {
 public:
  FilmView(const FilmCamera& camera, int zoom)
      : width(camera.width_px * zoom),
        height(camera.height_px * zoom),
        flat_(camera.height_m > 0.0),
        eye_(camera.eye_m) {
    const Eigen::Vector3d forward = (camera.target_m - camera.eye_m).normalized();
    Eigen::Vector3d right = forward.cross(Eigen::Vector3d::UnitZ());
    if (right.norm() < 1e-9) right = -Eigen::Vector3d::UnitY();  // from above: x of W up
    right.normalize();
    R_CW.row(0) = right;
    R_CW.row(1) = forward.cross(right);
    R_CW.row(2) = forward;
    scale_ =
        flat_ ? height / camera.height_m : 0.5 * height / std::tan(0.5 * camera.field_of_view_rad);
    // A view without perspective has no near plane: its eye steps back
    if (flat_) eye_ -= 100.0 * forward;
  }

  double depth(const Eigen::Vector3d& p_W) const { return R_CW.row(2).dot(p_W - eye_); }
  double pixels_per_metre(double depth_m) const { return flat_ ? scale_ : scale_ / depth_m; }
  /// Precondition: depth at least kNear.
  Eigen::Vector2d pixel(const Eigen::Vector3d& p_W) const {
    const Eigen::Vector3d p_C = R_CW * (p_W - eye_);
    return centre() + pixels_per_metre(p_C.z()) * p_C.head<2>();
  }
  /// Point of W at a pixel and a depth.
  Eigen::Vector3d point(double u, double v, double depth_m) const {
    Eigen::Vector3d p_C;
    p_C << (Eigen::Vector2d(u, v) - centre()) / pixels_per_metre(depth_m), depth_m;
    return eye_ + R_CW.transpose() * p_C;
  }

  static constexpr double kNear = 0.05;  ///< [m]; nearer things are not drawn
  int width, height;
  Eigen::Matrix3d R_CW;

 private:
  Eigen::Vector2d centre() const { return {0.5 * (width - 1), 0.5 * (height - 1)}; }
  bool flat_;
  Eigen::Vector3d eye_;
  double scale_;
};

}  // namespace mimesis::synthesizer
