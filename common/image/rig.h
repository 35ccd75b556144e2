#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <span>
#include <string>
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

/// What is behind a camera's pixels: focal lengths, centre and distortion (Brown 1971, as OpenCV
/// writes it). With x = X/Z, y = Y/Z, r² = x² + y², c = 1 + k1 r² + k2 r⁴ + k3 r⁶:
///   u = cx + fx (x c + 2 p1 x y + p2 (r² + 2 x²)),  v = cy + fy (y c + p1 (r² + 2 y²) + 2 p2 x y)
struct Lens {
  int width_px = 0, height_px = 0;
  double fx_px = 0.0, fy_px = 0.0, cx_px = 0.0, cy_px = 0.0;
  std::array<double, 5> distortion{};  ///< k1 k2 p1 p2 k3 [1]

  /// Pixel of a point in frame C (x right, y down, z forward). Precondition: z > 0.
  Eigen::Vector2d project(const Eigen::Vector3d& p_C) const;
  /// (x, y) at depth 1 that is seen at a pixel: inverse of `project`, to 1e-10 where the lens does
  /// not fold.
  Eigen::Vector2d normalized(const Eigen::Vector2d& pixel) const;
  /// Whether the distortion maps two directions within the picture on one pixel: then it describes
  /// no lens.
  bool folds() const;
};

/// A camera on the table: lens, and pose in frame T (x right, y up, z towards the camera). Axes of
/// C: x right, y down, z forward; p_C = R_CT (p_T - p_TC).
class Camera {
 public:
  /// @param p_TC position of the camera in T [m]
  Camera(const Lens& lens, Eigen::Matrix3d R_CT, Eigen::Vector3d p_TC);
  /// Camera of a view: no distortion, no roll.
  /// @throws ConfigError if it looks straight up or down, or stands on its target.
  Camera(const View& view);

  /// Pixel of a point in T. Precondition: in front of the camera.
  Eigen::Vector2d project(const Eigen::Vector3d& p_T) const {
    return lens_.project(in_camera(p_T));
  }
  /// Distance along the optical axis [m].
  double depth(const Eigen::Vector3d& p_T) const { return r_ct_.row(2).dot(p_T - eye_); }
  Eigen::Vector3d in_camera(const Eigen::Vector3d& p_T) const { return r_ct_ * (p_T - eye_); }
  /// Direction of the ray through a pixel, in T, scaled to depth 1.
  Eigen::Vector3d ray(double u, double v) const;
  /// Point seen at a pixel if it lies in the plane of motion (z = 0): (x, y) in T [m]; nothing
  /// behind the camera or along the plane.
  std::optional<Eigen::Vector2d> on_plane(double u, double v) const;
  /// Pixels per metre at a point in T.
  double scale(const Eigen::Vector3d& p_T) const {
    return 0.5 * (lens_.fx_px + lens_.fy_px) / depth(p_T);
  }

  const Lens& lens() const { return lens_; }
  const Eigen::Vector3d& eye() const { return eye_; }
  const Eigen::Matrix3d& R_CT() const { return r_ct_; }
  int width() const { return lens_.width_px; }
  int height() const { return lens_.height_px; }

 private:
  Lens lens_;
  Eigen::Matrix3d r_ct_;
  Eigen::Vector3d eye_;
};

/// Where one camera sees a point.
struct Sighting {
  const Camera* camera;
  Eigen::Vector2d pixel;
  double sigma_px = 1.0;  ///< standard deviation of u and of v
};

struct Triangulated {
  Eigen::Vector3d p_T;
  Eigen::Matrix3d covariance_m2;  ///< of p_T, from the sigmas of the sightings
  double residual_px;             ///< rms over u and v of all sightings
};

/// Point that two or more cameras see: nearest to the rays, then least squares in the pictures
/// (Gauss-Newton). Nothing if the rays are parallel (to 0.1°) or the point is behind a camera.
std::optional<Triangulated> triangulate(std::span<const Sighting> sightings);

/// Distances of a point's two pixels to each other's epipolar lines, mean of both, in pixels of
/// pictures without distortion.
double epipolar_distance(const Camera& a, const Camera& b, const Eigen::Vector2d& pixel_a,
                         const Eigen::Vector2d& pixel_b);

/// Two cameras turned in software until their rows run along the baseline: a point is in the same
/// row of both rectified pictures, at columns that differ by focal · baseline / depth. The
/// rectified pictures have the size of the left one and hold all that both cameras see.
class Rectification {
 public:
  /// @throws ConfigError if the cameras stand at one place, or one behind the other.
  Rectification(const Camera& left, const Camera& right);

  /// @param side 0 left, 1 right
  Eigen::Vector2d rectified(int side, const Eigen::Vector2d& pixel) const;
  /// Pixel of the camera's own picture; inverse of `rectified`.
  Eigen::Vector2d original(int side, const Eigen::Vector2d& rectified) const;
  double focal_px() const { return focal_; }
  double baseline_m() const { return baseline_; }

 private:
  std::array<Camera, 2> cameras_;
  Eigen::Matrix3d r_nt_;  ///< from T to the common, turned frame
  double focal_, cx_, cy_, baseline_;
};

/// One camera of a rig.
struct RigCamera {
  std::string name;
  Camera camera;
  double held_out_px = 0.0;  ///< rms of corners in pictures that were left out when calibrating
};

/// Cameras that were calibrated together.
struct Rig {
  enum class Frame { camera, table, flange, base };

  std::string date;   ///< of the calibration, YYYY-MM-DD
  std::string board;  ///< words: "9x6 corners, squares of 25 mm"
  /// T of the poses: the first camera's (x right, y down, z forward), or that in which it was
  /// placed: the table's by `mimesis calibrate table`; by `mimesis calibrate hand-eye` that of an
  /// arm's poses: its flange, which carries the cameras, or its base.
  Frame frame = Frame::camera;
  int pictures = 0;          ///< pairs (or pictures of a single camera) that were used
  double epipolar_px = 0.0;  ///< held out, mean per side; 0 with one camera
  std::vector<RigCamera> cameras;
  /// Of hand-eye: 2 sigma of the first camera's place, along and about the axes of the frame.
  Eigen::Vector3d position_2sigma_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotation_2sigma_rad = Eigen::Vector3d::Zero();

  /// Camera of this name; null if there is none.
  const RigCamera* find(const std::string& name) const;
};

}  // namespace mimesis::image
