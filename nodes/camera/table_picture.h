#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
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

/// Boxes, upright cylinders and a horizontal table top, met by rays: what stands still before the
/// camera.
class RayScene {
 public:
  /// @param table_top whether the wooden table (y = 0) is part of it
  explicit RayScene(bool table_top) : table_top_(table_top) {}
  void add_box(const Eigen::Vector3d& center, const Eigen::Vector3d& half_extent, const Bgr& color);
  /// Upright, from `base` up.
  void add_cylinder(const Eigen::Vector3d& base, double radius, double height, const Bgr& side,
                    const Bgr& top);

  /// Nearest surface in front of `origin`, the table included; nothing if the ray leaves the scene.
  std::optional<Hit> trace(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction) const;
  /// True if something other than the table lies between two points.
  bool blocked(const Eigen::Vector3d& from, const Eigen::Vector3d& to) const;

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
  bool table_top_;
  std::vector<Box> boxes_;
  std::vector<Cylinder> cylinders_;
};

/// Grain of the wooden table at (x, z) [m].
Bgr wood(double x, double z);

/// Position of the lamp, frame T [m]; shared by everything that is shaded.
inline const Eigen::Vector3d kLamp{-0.7, 1.9, 1.5};

/// Light on a surface: ambient plus Lambert's cosine, 0..1 [1].
float lambert(const Eigen::Vector3d& normal, const Eigen::Vector3d& to_lamp);

/// The empty table as the camera sees it: drawn once, then copied under the moving hand.
struct TablePicture {
  image::Image color;
  std::vector<float> depth;  ///< along the optical axis [m], per pixel
  std::vector<std::uint8_t>
      wood;  ///< 1 where the table top is seen: shadows of the hand fall there
};

/// Casts 4 rays a pixel, each with 4 shadow rays to an extended lamp: takes some tenths of a
/// second.
TablePicture draw_scene(const RayScene& scene, const image::Camera& camera);

/// The teacher's table. @param clutter number of small coloured things lying about, placed by
/// `seed`
TablePicture draw_table(const TeacherTable& table, const image::Camera& camera, int clutter,
                        std::uint64_t seed);

}  // namespace mimesis::camera
