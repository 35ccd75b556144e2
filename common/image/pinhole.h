#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

namespace mimesis::image {

/// Calibration of a camera on the teacher's table, frame T (x right, y up, z towards the camera).
struct View {
  std::vector<double> eye_m{0.40, 0.50, 1.00};      ///< p_TC, position of the camera
  std::vector<double> target_m{-0.01, 0.125, 0.0};  ///< point in T in the middle of the image
  double focal_px = 740.0;                          ///< focal length
  int width_px = 640;                               ///< width of the image
  int height_px = 480;                              ///< height of the image

  template <class Visitor>
  void visit(Visitor& v) {
    v("eye_m", eye_m, -20.0, 20.0, 3);
    v("target_m", target_m, -20.0, 20.0, 3);
    v("focal_px", focal_px, 50.0, 20000.0);
    v("width_px", width_px, 8, 8192);
    v("height_px", height_px, 8, 8192);
  }
};

/// Pinhole camera without distortion and roll: u = cx + f X/Z, v = cy + f Y/Z with p_C = R_CT (p_T
/// - p_TC), axes of C: x right, y down, z forward.
class Pinhole {
 public:
  /// @throws ConfigError if the camera looks straight up or down, or stands on its target.
  explicit Pinhole(const View& view);

  /// Pixel of a point in T. Precondition: in front of the camera.
  Eigen::Vector2d project(const Eigen::Vector3d& p_T) const;
  /// Distance along the optical axis [m].
  double depth(const Eigen::Vector3d& p_T) const;
  /// Direction of the ray through a pixel, in T, scaled to depth 1.
  Eigen::Vector3d ray(double u, double v) const;
  /// Point seen at a pixel if it lies in the plane of motion (z = 0): (x, y) in T [m]; nothing
  /// behind the camera or along the plane.
  std::optional<Eigen::Vector2d> on_plane(double u, double v) const;
  /// Pixels per metre at a point in T.
  double scale(const Eigen::Vector3d& p_T) const { return focal_ / depth(p_T); }

  const Eigen::Vector3d& eye() const { return eye_; }
  const Eigen::Matrix3d& R_CT() const { return r_ct_; }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  Eigen::Vector3d eye_;
  Eigen::Matrix3d r_ct_;
  double focal_, cx_, cy_;
  int width_, height_;
};

}  // namespace mimesis::image
