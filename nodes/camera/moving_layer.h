#pragma once
#include <span>
#include <vector>

#include "common/image/image.h"
#include "nodes/camera/hand_shape.h"
#include "nodes/camera/table_picture.h"

namespace mimesis::camera {

/// An upright cylinder that moves. Frame T [m].
struct MovingCylinder {
  Eigen::Vector3d center;
  double radius, height;
  Bgr color;
};

/// Draws what moves over the picture of the table: hidden surfaces by depth, smooth edges, shading,
/// and a soft shadow on the table top.
class MovingLayer {
 public:
  MovingLayer(const image::Pinhole& camera, const TablePicture& table);

  /// Paints into `image`, which holds a copy of the table's picture.
  void draw(std::span<const Capsule> hand, const MovingCylinder& object, image::Image& image);

 private:
  void cast_shadow(std::span<const Capsule> hand, const MovingCylinder& object,
                   image::Image& image);
  void shadow_disc(const Eigen::Vector3d& p, double radius);
  void draw_capsule(const Capsule& capsule, image::Image& image);
  void draw_cylinder(const MovingCylinder& cylinder, image::Image& image);
  void blend(int u, int v, float depth, float coverage, const Bgr& color, image::Image& image);

  const image::Pinhole& camera_;
  const TablePicture& table_;
  std::vector<float> depth_;
  std::vector<std::uint8_t> shadow_, soft_,
      large_;  ///< shadow at a quarter of the resolution, and full
};

}  // namespace mimesis::camera
