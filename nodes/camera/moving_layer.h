#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "common/image/image.h"
#include "nodes/camera/table_picture.h"
#include "nodes/camera/teacher.h"

namespace mimesis::camera {

/// Segment swept by a ball whose radius changes linearly. Frame T [m].
struct Capsule {
  Eigen::Vector3d a, b;
  double radius_a, radius_b;
  Bgr color;
};

/// A left arm: 5 of the palm, 15 of the fingers, forearm and sleeve. Phalange lengths after
/// Buchholz et al. 1992 for a hand of 185 mm; thicknesses and postures by eye.
void hand_capsules(const TeacherPose& pose, Grip grip, const Looks& looks,
                   std::vector<Capsule>& out);

/// Something upright that is carried past between the cameras and the table.
struct Passer {
  double begin_s = -1.0;   ///< when it comes into view, negative: never
  double speed_m_s = 0.0;  ///< along x, from the right if negative
  double z_m = 0.0;        ///< before the plane of motion
  double lean = 0.0;       ///< x over y [1]
  double radius_m = 0.01;
  Bgr color = Bgr::Zero();

  /// Where it is at a time, if it is in view.
  std::optional<Capsule> at(double t_s) const;
};

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
  MovingLayer(const image::Camera& camera, const TablePicture& table);

  /// Paints into `image`, which holds a copy of the table's picture.
  void draw(std::span<const Capsule> hand, const MovingCylinder& object, image::Image& image);

 private:
  void cast_shadow(std::span<const Capsule> hand, const MovingCylinder& object,
                   image::Image& image);
  void shadow_disc(const Eigen::Vector3d& p, double radius);
  void draw_capsule(const Capsule& capsule, image::Image& image);
  void draw_cylinder(const MovingCylinder& cylinder, image::Image& image);
  void blend(int u, int v, float depth, float coverage, const Bgr& color, image::Image& image);

  const image::Camera& camera_;
  const TablePicture& table_;
  std::vector<float> depth_;
  std::vector<std::uint8_t> shadow_, soft_,
      large_;  ///< shadow at a quarter of the resolution, and full
};

}  // namespace mimesis::camera
