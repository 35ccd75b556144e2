#include "experiments/walk/film/robot_film.h"

#include <algorithm>

#include "common/error.h"
#include "common/robot/kinematics.h"

namespace mimesis::film {
namespace {

using Eigen::Vector3d;
using synthesizer::FilmBox;
using synthesizer::FilmLimb;
using synthesizer::paler;

constexpr Colour kTrunk{150, 156, 166}, kLeft{64, 124, 190}, kRight{214, 104, 66};
constexpr Colour kSole{60, 62, 68};
constexpr Colour kWood{196, 164, 124}, kFront{222, 192, 150}, kHandle{70, 70, 76};
constexpr Colour kObject{196, 60, 88}, kPush{200, 40, 40};

Vector3d along(double yaw_rad) { return {std::cos(yaw_rad), std::sin(yaw_rad), 0.0}; }

Colour colour_of(const robot::LinkShape& shape) {
  if (shape.sole) return kSole;
  return shape.part == robot::BodyPart::left    ? kLeft
         : shape.part == robot::BodyPart::right ? kRight
                                                : kTrunk;
}

}  // namespace

RobotFigure::RobotFigure(const robot::Biped& biped, const std::string& urdf_file)
    : biped_(biped), shapes_(robot::link_shapes(biped, urdf_file)) {}

void RobotFigure::add_to(FilmFrame& frame, const Eigen::Isometry3d& X_WB, const Eigen::VectorXd& q,
                         double pale) const {
  robot::Kinematics kinematics(biped_.tree);
  kinematics.update(X_WB, q);
  for (const robot::LinkShape& shape : shapes_) {
    const Eigen::Isometry3d X_WP = kinematics.X_WL(shape.link) * shape.X_LP;
    const Colour colour = paler(colour_of(shape), pale);
    if (shape.radius_m > 0.0) {
      const Vector3d half = 0.5 * shape.length_m * X_WP.linear().col(2);
      frame.limbs.push_back({X_WP.translation() - half, X_WP.translation() + half, shape.radius_m,
                             shape.radius_m, colour});
      continue;
    }
    frame.boxes.push_back({.center = X_WP.translation(),
                           .half_extent = 0.5 * shape.edges_m,
                           .colour = colour,
                           .tilt = Eigen::Quaterniond(X_WP.linear())});
  }
}

void add_drawer(FilmFrame& frame, const FilmDrawer& drawer) {
  constexpr double kBoard_m = 0.012, kTrayHalf_m = 0.05;
  const Vector3d in = along(drawer.yaw_rad), left(-in.y(), in.x(), 0.0);
  const double opened = in.dot(drawer.front_W_m - drawer.handle_W_m);
  const double tray_m = drawer.handle_W_m.z(), top_m = tray_m - kTrayHalf_m - kBoard_m;
  const auto box = [&](double depth, double side, double height, const Vector3d& half,
                       const Colour& colour) {
    Vector3d at = drawer.front_W_m + depth * in + side * left;
    at.z() = height;
    frame.boxes.push_back(
        {.center = at, .half_extent = half, .yaw_rad = drawer.yaw_rad, .colour = colour});
  };
  const double half_depth = 0.5 * drawer.depth_m, half_width = 0.5 * drawer.width_m;
  box(half_depth, 0.0, 0.5 * top_m, {half_depth, half_width, 0.5 * top_m}, kWood);
  // the drawer: bottom, front, sides, back
  box(half_depth - opened, 0.0, tray_m - kTrayHalf_m, {half_depth, half_width, 0.5 * kBoard_m},
      kFront);
  const double inner = half_width - kBoard_m;
  box(kBoard_m - opened, 0.0, tray_m, {kBoard_m, half_width, kTrayHalf_m}, kFront);
  for (const double side : {-inner, inner}) {
    box(half_depth - opened, side, tray_m, {half_depth, kBoard_m, kTrayHalf_m}, kFront);
  }
  box(drawer.depth_m - opened, 0.0, tray_m, {kBoard_m, inner, kTrayHalf_m}, kFront);
  const Vector3d handle = drawer.handle_W_m - 0.01 * in;
  frame.limbs.push_back({handle - 0.04 * left, handle + 0.04 * left, 0.012, 0.012, kHandle});
  synthesizer::add_dot(frame, drawer.object_W_m, 0.035, kObject);
}

void add_push(FilmFrame& frame, const Vector3d& p_W_m, const Vector3d& impulse_W_ns) {
  constexpr double kLength_m_ns = 0.02, kHead_m = 0.09;
  if (impulse_W_ns.norm() < 1e-9) return;
  const Vector3d way = impulse_W_ns.normalized();
  const Vector3d neck = p_W_m - kHead_m * way;
  const Vector3d tail = neck - kLength_m_ns * impulse_W_ns;
  frame.limbs.push_back({tail, neck, 0.018, 0.018, kPush});
  frame.limbs.push_back({neck, p_W_m, 0.05, 0.004, kPush});
}

synthesizer::FilmCamera camera_beside(const Eigen::Vector2d& p_W_m, double yaw_rad, double from_rad,
                                      double height_m, int width_px) {
  synthesizer::FilmCamera camera;
  camera.target_m << p_W_m, 0.43 * height_m;
  camera.eye_m = camera.target_m + 6.0 * along(yaw_rad + from_rad) + Vector3d(0.0, 0.0, 2.0);
  camera.height_m = height_m;
  camera.width_px = width_px;
  camera.height_px = width_px * 3 / 2;
  return camera;
}

}  // namespace mimesis::film
