#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/image/image.h"
#include "common/motion/mocap/body.h"

namespace mimesis::synthesizer {

/// Each 0 .. 255.
struct Colour {
  int red = 0, green = 0, blue = 0;
};

/// Mixed with white: 0 as it is .. 1 white. For poses that stand behind the one that counts.
Colour paler(const Colour& colour, double amount);

/// A rod with round, possibly unequal ends; a ball if both ends are one place. W [m].
struct FilmLimb {
  Eigen::Vector3d from, to;
  double radius_from = 0.03, radius_to = 0.03;  ///< [m]
  Colour colour;
};

/// A box that stands upright, unless it is tilted. W [m].
struct FilmBox {
  Eigen::Vector3d center, half_extent;
  double yaw_rad = 0.0;
  Colour colour{178, 150, 118};
  Eigen::Quaterniond tilt = Eigen::Quaterniond::Identity();  ///< about the center, after the yaw
};

/// Looks from `eye` at `target`, z of W up in the picture. Perspective, or orthographic if
/// `height_m` is given.
struct FilmCamera {
  Eigen::Vector3d eye_m{1.5, -4.0, 1.6}, target_m{0.0, 0.0, 0.85};  ///< W
  double field_of_view_rad = 0.6;  ///< from the upper to the lower edge of the picture
  double height_m = 0.0;           ///< > 0: orthographic, height of the picture [m]
  int width_px = 640, height_px = 480;

  /// The view moved along: for figures that travel.
  FilmCamera moved(const Eigen::Vector3d& by_m) const;
};

/// Contents of one picture: limbs and boxes hide each other as they should and cast shadows on the
/// ground z = 0; parts below the ground show through palely.
struct FilmFrame {
  std::vector<FilmLimb> limbs;
  std::vector<FilmBox> boxes;
  FilmCamera camera;
  std::string label;    ///< upper left corner, e.g. film_time(t); ASCII
  double grid_m = 0.5;  ///< spacing of the lines on the ground
};

/// "t = 1.25 s"
std::string film_time(double seconds);

/// How a figure is painted. Left and right limbs differ so that they can be told apart in profile.
struct FilmPaint {
  Colour trunk{88, 92, 102}, left{38, 112, 190}, right{206, 84, 52}, skin{226, 178, 142};
  double pale = 0.0;   ///< see paler()
  double thick = 1.0;  ///< limb radii relative to those of a person
};

/// A person: limbs, pelvis and shoulders, a ball for the head, feet with heel and toe whose soles
/// touch the body's ground points.
void add_body(FilmFrame& to, const mocap::Body& body, const mocap::BodyPose& pose,
              const FilmPaint& paint = {});
/// A target or a marker.
void add_dot(FilmFrame& to, const Eigen::Vector3d& p_W, double radius_m, const Colour& colour);

image::Image draw(const FilmFrame& frame);

/// An orthographic view from the right of the way from the first to the last frame (so that travel
/// goes from left to right), a little from above, that holds all limbs and boxes of all frames.
/// Precondition: one frame with a limb or a box at least.
FilmCamera side_view(std::span<const FilmFrame> frames, int width_px, int height_px);

/// `count` frames evenly chosen, the first and the last among them.
std::vector<std::size_t> evenly_chosen(std::size_t frames, int count);
/// Frames side by side, each as wide as given.
image::Image strip(std::span<const FilmFrame> frames, int count, int cell_width_px);
/// Poses of one film along their path in one picture as in [M18 fig. 3.37]: earlier ones paler, the
/// last frame's boxes and label.
image::Image poses_along_path(std::span<const FilmFrame> frames, int count,
                              const FilmCamera& camera);

struct StripOptions {
  int count = 6;
  int cell_width_px = 320;                 ///< width of pictures side by side
  std::optional<FilmCamera> along_path{};  ///< poses in one picture, seen by this camera, instead
};

/// Writes FOLDER/NAME/frame_0000.png ... and the strip FOLDER/NAME.png. Returns the strip and the
/// folder of the frames. @throws std::runtime_error if a file cannot be written.
std::vector<std::filesystem::path> write_film(std::span<const FilmFrame> frames,
                                              const std::filesystem::path& folder,
                                              const std::string& name,
                                              const StripOptions& options = {});

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
