#include "nodes/camera/robot_renderer.h"

#include <cmath>
#include <numbers>

namespace mimesis::camera {
namespace {

using Eigen::Vector3d;

const Bgr kGrey(150.0f, 146.0f, 142.0f), kStand(186.0f, 190.0f, 194.0f), kArm(66.0f, 62.0f, 60.0f);
constexpr double kCapHeight = 0.02;  // of a stand [m]

/// Axes of T from those of W: x, y, z of T are y, z, x of W.
Vector3d turned(const Vector3d& v_W) { return {v_W.y(), v_W.z(), v_W.x()}; }

RayScene robot_scene(const kin::Table& table, const Paints& paints, const Room& room,
                     const Vector3d& origin) {
  RayScene scene(room);
  const auto at = [&origin](const Vector3d& p_W) { return turned(p_W - origin); };
  for (const kin::Box& box : table.boxes) {
    if (box.name == "table top") continue;
    const Vector3d half = turned(box.half_extent), center = at(box.center);
    const bool stand = box.name.ends_with("stand"), block = box.name.starts_with("block");
    if (!stand) {
      scene.add_box(center, half, block ? paints.light_object : kGrey);
      continue;
    }
    const Vector3d cap = 0.5 * kCapHeight * Vector3d::UnitY();
    scene.add_box(center - cap, half - cap, kStand);
    scene.add_box(center + half.y() * Vector3d::UnitY() - cap, {half.x(), cap.y(), half.z()},
                  box.name.starts_with("high") ? paints.goal_high : paints.goal_low);
  }
  if (table.balls.empty()) return scene;
  const double radius = table.balls.front().radius;
  const Vector3d bar = at(table.bar_center);
  scene.add_box(bar, {table.bar_half_width + radius, radius, radius}, paints.bar);
  for (const double side : {-1.0, 1.0}) {
    scene.add_cylinder({bar.x() + side * table.bar_half_width, 0.0, bar.z()}, 0.8 * radius,
                       bar.y() - radius, kGrey, kGrey);
  }
  return scene;
}

}  // namespace

bool sees_all(const kin::Table& table, const Vector3d& origin_W, const image::Camera& camera) {
  constexpr double kAround = 0.015, kAbove = 0.002;  // [m]
  const RayScene scene = robot_scene(table, Paints{}, Room{}, origin_W);
  const auto seen = [&](const Vector3d& p_W) {
    const Vector3d p = turned(p_W - origin_W);
    const Eigen::Vector2d pixel = camera.project(p);
    return pixel.minCoeff() > 0.0 && pixel.x() < camera.width() && pixel.y() < camera.height() &&
           !scene.blocked(camera.eye(), p);
  };
  const double wide = table.object_radius + kAround, half = 0.5 * table.object_height;
  constexpr int kPoints = 12;
  for (const double up : {-half + kAbove, 0.0, half}) {
    for (int k = 0; k < kPoints; ++k) {
      const double a = 2.0 * std::numbers::pi * k / kPoints;
      if (!seen(table.object + Vector3d(wide * std::cos(a), wide * std::sin(a), up))) return false;
    }
  }
  for (const kin::Box& box : table.boxes) {
    if (!box.name.ends_with("stand")) continue;
    const double top = box.half_extent.z() + kAbove;
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) {
        const Vector3d corner(x * box.half_extent.x(), y * box.half_extent.y(), top);
        if (!seen(box.center + corner)) return false;
      }
    }
  }
  return true;
}

RobotRenderer::RobotRenderer(const kin::Table& table, const Paints& paints, const Room& room,
                             const Vector3d& origin_W, const image::Camera& camera,
                             const Faults& faults, std::uint64_t seed, int eye)
    : robot_(table),
      object_color_(paints.light_object),
      origin_(origin_W),
      camera_(camera),
      table_(draw_scene(robot_scene(table, paints, room, origin_W), camera_)),
      layer_(camera_, table_),
      noise_seed_(seed + (static_cast<std::uint64_t>(eye) << 40)),
      faults_(faults, noise_seed_) {}

std::vector<Click> RobotRenderer::clicks() const {
  std::vector<Click> out{click("object", in_T(robot_.object), camera_),
                         click("bar", in_T(robot_.bar_center), camera_)};
  for (const kin::GoalPlace& goal : robot_.goals) {
    const Vector3d top = in_T(goal.position) - 0.5 * robot_.object_height * Vector3d::UnitY();
    out.push_back(click(goal.name == "high" ? "goal_high" : "goal_low", top, camera_));
  }
  return out;
}

Vector3d RobotRenderer::in_T(const Vector3d& p_W) const { return turned(p_W - origin_); }

void RobotRenderer::render(const std::vector<kin::Ball>& arm, const Vector3d& object_W, double t_s,
                           image::Image& out) {
  constexpr double kThinner = 0.8;  // than the safety balls around it
  out = table_.color;
  arm_.clear();
  for (const kin::Ball& ball : arm) {
    const Vector3d p = in_T(ball.center);
    arm_.push_back({p, p, kThinner * ball.radius, kThinner * ball.radius, kArm});
  }
  layer_.draw(arm_, {in_T(object_W), robot_.object_radius, robot_.object_height, object_color_},
              out);
  faults_.apply(static_cast<std::uint64_t>(std::llround(1e6 * t_s)), out);
}

}  // namespace mimesis::camera
