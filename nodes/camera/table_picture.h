#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "common/image/image.h"
#include "common/image/rig.h"
#include "nodes/camera/teacher.h"

namespace mimesis::camera {

/// Surface point met by a ray.
struct Hit {
  double distance = 0.0;  ///< in lengths of the ray's direction
  Eigen::Vector3d normal = Eigen::Vector3d::UnitY();
  Bgr color = Bgr::Zero();
};

/// Table top and light, frame T.
struct Room {
  Eigen::Vector3d lamp_m{-0.7, 1.9, 1.5};
  Bgr wood{141.0f, 152.0f, 161.0f};
  double grain = 1.0;     ///< contrast of its texture [1]
  double plank_m = 0.17;  ///< width of a plank along z

  /// Colour of the table top at (x, z) [m].
  Bgr table_top(double x, double z) const;
};

/// Boxes, upright cylinders and a horizontal table top, met by rays: what stands still before the
/// camera.
class RayScene {
 public:
  RayScene() = default;  ///< nothing, no table top either
  explicit RayScene(const Room& room) : room_(room) {}
  void add_box(const Eigen::Vector3d& center, const Eigen::Vector3d& half_extent, const Bgr& color);
  /// Upright, from `base` up.
  void add_cylinder(const Eigen::Vector3d& base, double radius, double height, const Bgr& side,
                    const Bgr& top);

  /// Nearest surface in front of `origin`, the table included; nothing if the ray leaves the scene.
  std::optional<Hit> trace(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  const Room& room() const { return *room_; }
  /// True if something other than the table lies between two points.
  bool blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;
  /// How many of four points above are not blocked: quicker than one after the other.
  int seen_from(const Eigen::Vector3d& from, std::span<const Eigen::Vector3d, 4> to) const;

 private:
  struct Box {
    Eigen::Vector3d center, half_extent;
    Bgr color;
  };
  struct Cylinder {
    Eigen::Vector3d base;
    double radius, height;
    Bgr side, top;
  };
  static void meet(const Box& box, const Eigen::Vector3d& o, const Eigen::Vector3d& d, Hit& hit);
  static void meet(const Cylinder& c, const Eigen::Vector3d& o, const Eigen::Vector3d& d, Hit& hit);
  std::optional<Room> room_;
  std::vector<Box> boxes_;
  std::vector<Cylinder> cylinders_;
  double top_m_ = 0.0;  ///< of the highest thing
};

/// Light on a surface: ambient plus Lambert's cosine, 0..1 [1].
float lambert(const Eigen::Vector3d& normal, const Eigen::Vector3d& to_lamp);

/// The empty table as the camera sees it: drawn once, then copied under the moving hand.
struct TablePicture {
  Room room;
  image::Image color;
  std::vector<float> depth;  ///< along the optical axis [m], per pixel
  std::vector<std::uint8_t>
      wood;  ///< 1 where the table top is seen: shadows of the hand fall there
};

/// Casts 4 rays a pixel, each with 4 shadow rays to an extended lamp: takes some tenths of a
/// second.
TablePicture draw_scene(const RayScene& scene, const image::Camera& camera);

/// Small coloured things lying about.
struct Clutter {
  int count = 12, like_skin = 0;  ///< and how many of them have the colour of the skin [1]
  Bgr skin = Bgr::Zero();
  std::uint64_t seed = 1;  ///< places them
};

/// The teacher's table.
TablePicture draw_table(const TeacherTable& table, const image::Camera& camera, const Room& room,
                        const Clutter& clutter);

}  // namespace mimesis::camera
