#include "experiments/walk/film/robot_film.h"

#include <urdf_parser/urdf_parser.h>

#include <algorithm>

#include "common/error.h"
#include "common/math/so3.h"
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
constexpr double kRod_m = 0.045;

Eigen::Isometry3d pose_of(const urdf::Pose& pose) {
  Eigen::Isometry3d X = Eigen::Isometry3d::Identity();
  X.translation() << pose.position.x, pose.position.y, pose.position.z;
  X.linear() =
      Eigen::Quaterniond(pose.rotation.w, pose.rotation.x, pose.rotation.y, pose.rotation.z)
          .toRotationMatrix();
  return X;
}

Vector3d along(double yaw_rad) { return {std::cos(yaw_rad), std::sin(yaw_rad), 0.0}; }

}  // namespace

RobotFigure::RobotFigure(const robot::Biped& biped, const std::string& urdf_file) : biped_(biped) {
  read_shapes(urdf_file);
  if (pieces_.empty()) make_rods();
}

Colour RobotFigure::colour_of(int link) const {
  const auto limb = [&](robot::Side side) {
    const auto& tree = biped_.tree;
    const auto& leg = biped_.leg[side];
    const int thigh = tree.moved_link(leg.dof[robot::kHipFirst]);
    if (tree.carries(thigh, link)) return true;
    // an arm: what carries the hand, or hangs on it, but not on both sides' way to the trunk
    const int hand = biped_.hand[side], other = biped_.hand[robot::other(side)];
    if (hand < 0) return false;
    for (int at = link; at >= 0; at = tree.link(at).parent) {
      if (tree.carries(at, hand)) return other < 0 || !tree.carries(at, other);
    }
    return false;
  };
  return limb(robot::kLeft) ? kLeft : limb(robot::kRight) ? kRight : kTrunk;
}

void RobotFigure::read_shapes(const std::string& urdf_file) {
  const auto model = urdf::parseURDFFile(urdf_file);
  if (model == nullptr) throw ConfigError(urdf_file + ": expected a URDF file");
  for (std::size_t i = 0; i < biped_.tree.links().size(); ++i) {
    const auto link = model->getLink(biped_.tree.links()[i].name);
    if (link == nullptr) continue;  // a frame that only we know
    const auto index = static_cast<int>(i);
    for (const auto& visual : link->visual_array) {
      if (visual == nullptr || visual->geometry == nullptr) continue;
      Piece piece{.link = index, .X_LP = pose_of(visual->origin), .colour = colour_of(index)};
      if (const auto* box = dynamic_cast<const urdf::Box*>(visual->geometry.get())) {
        piece.half_extent_m << 0.5 * box->dim.x, 0.5 * box->dim.y, 0.5 * box->dim.z;
      } else if (const auto* ball = dynamic_cast<const urdf::Sphere*>(visual->geometry.get())) {
        piece.radius_m = ball->radius;
      } else if (const auto* rod = dynamic_cast<const urdf::Cylinder*>(visual->geometry.get())) {
        piece.radius_m = rod->radius;
        piece.half_length_m = 0.5 * rod->length;
      } else {
        continue;
      }
      pieces_.push_back(piece);
    }
  }
}

void RobotFigure::make_rods() {
  for (std::size_t i = 1; i < biped_.tree.links().size(); ++i) {
    const robot::Link& link = biped_.tree.links()[i];
    const Vector3d bone = link.X_PJ.translation();
    if (bone.norm() < 0.01 || link.inertia.mass_kg <= 0.0) continue;  // frames have no bones
    Piece piece{.link = link.parent,
                .radius_m = kRod_m,
                .half_length_m = 0.5 * bone.norm(),
                .colour = colour_of(static_cast<int>(i))};
    piece.X_LP.translation() = 0.5 * bone;
    piece.X_LP.linear() = math::rotation_onto(Vector3d::UnitZ(), bone);
    pieces_.push_back(piece);
  }
  for (const robot::Biped::Leg& leg : biped_.leg) {
    Piece sole{.link = leg.sole, .colour = kSole};
    sole.half_extent_m << 0.5 * (leg.max_S_m - leg.min_S_m), 0.015;
    sole.X_LP.translation() << 0.5 * (leg.max_S_m + leg.min_S_m), 0.015;
    pieces_.push_back(sole);
  }
}

void RobotFigure::add_to(FilmFrame& frame, const Eigen::Isometry3d& X_WB, const Eigen::VectorXd& q,
                         double pale) const {
  robot::Kinematics kinematics(biped_.tree);
  kinematics.update(X_WB, q);
  for (const Piece& piece : pieces_) {
    const Eigen::Isometry3d X_WP = kinematics.X_WL(piece.link) * piece.X_LP;
    const Colour colour = paler(piece.colour, pale);
    if (piece.radius_m > 0.0) {
      const Vector3d half = piece.half_length_m * X_WP.linear().col(2);
      frame.limbs.push_back({X_WP.translation() - half, X_WP.translation() + half, piece.radius_m,
                             piece.radius_m, colour});
      continue;
    }
    frame.boxes.push_back({.center = X_WP.translation(),
                           .half_extent = piece.half_extent_m,
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
