#include "nodes/camera/ray_scene.h"

#include <algorithm>
#include <cmath>

namespace mimesis::camera {
namespace {

using Eigen::Vector3d;

constexpr double kNear = 1e-6;
constexpr double kTableHalfWidth = 1.6, kTableBack = -0.62, kTableFront = 1.2;  // [m]

/// Smooth pseudo-random function of one variable, in [-1, 1].
double wave(double t) {
  return 0.5 * std::sin(t) + 0.3 * std::sin(2.3 * t + 1.7) + 0.2 * std::sin(5.1 * t + 0.4);
}

}  // namespace

Bgr wood(double x, double z) {
  constexpr double kPlank = 0.17;  // width of a plank along z [m]
  const double row = std::floor(z / kPlank);
  const double across = z / kPlank - row;
  const double bend = 0.012 * wave(3.0 * x + 7.0 * row);
  const double rings = wave(210.0 * (z + bend) + 11.0 * row) * (0.6 + 0.4 * wave(9.0 * x + row));
  const double fibre = wave(900.0 * z + 40.0 * wave(2.0 * x + row));
  const double tone = 1.0 + 0.06 * wave(12.9 * row) + 0.045 * rings + 0.015 * fibre;
  const double joint = std::min(across, 1.0 - across) * kPlank < 0.0012 ? 0.72 : 1.0;
  return Bgr(141.0f, 152.0f, 161.0f) * static_cast<float>(tone * joint);
}

void RayScene::add_box(const Vector3d& center, const Vector3d& half_extent, const Bgr& color) {
  boxes_.push_back({center, half_extent, color});
}

void RayScene::add_cylinder(const Vector3d& base, double radius, double height, const Bgr& side,
                            const Bgr& top) {
  cylinders_.push_back({base, radius, height, side, top});
}

void RayScene::meet(const Box& box, const Vector3d& o, const Vector3d& d, Hit& hit) {
  double enter = kNear, leave = hit.distance;
  int axis = -1;
  for (int i = 0; i < 3; ++i) {  // slabs
    const double inverse = 1.0 / d[i];
    double a = (box.center[i] - box.half_extent[i] - o[i]) * inverse;
    double b = (box.center[i] + box.half_extent[i] - o[i]) * inverse;
    if (a > b) std::swap(a, b);
    if (a > enter) {
      enter = a;
      axis = i;
    }
    leave = std::min(leave, b);
    if (enter > leave) return;
  }
  if (axis < 0) return;  // starts inside
  hit.distance = enter;
  hit.normal = Vector3d::Unit(axis) * (d[axis] > 0.0 ? -1.0 : 1.0);
  hit.color = box.color;
}

void RayScene::meet(const Cylinder& c, const Vector3d& o, const Vector3d& d, Hit& hit) {
  const double ox = o.x() - c.base.x(), oz = o.z() - c.base.z();
  const double top = c.base.y() + c.height;
  const double to_top = (top - o.y()) / d.y();
  if (to_top > kNear && to_top < hit.distance) {
    const double x = ox + to_top * d.x(), z = oz + to_top * d.z();
    if (x * x + z * z <= c.radius * c.radius) {
      hit.distance = to_top;
      hit.normal = Vector3d::UnitY();
      hit.color = c.top;
    }
  }
  const double a = d.x() * d.x() + d.z() * d.z();
  const double b = ox * d.x() + oz * d.z();
  const double root = b * b - a * (ox * ox + oz * oz - c.radius * c.radius);
  if (root <= 0.0) return;
  const double t = (-b - std::sqrt(root)) / a;
  const double y = o.y() + t * d.y();
  if (t <= kNear || t >= hit.distance || y < c.base.y() || y > top) return;
  hit.distance = t;
  hit.normal = Vector3d(ox + t * d.x(), 0.0, oz + t * d.z()) / c.radius;
  hit.color = c.side;
}

std::optional<Hit> RayScene::trace(const Vector3d& origin, const Vector3d& direction) const {
  constexpr double kFar = 1e9;
  Hit hit;
  hit.distance = kFar;
  const double t = -origin.y() / direction.y();
  if (table_top_ && t > kNear) {
    const double x = origin.x() + t * direction.x(), z = origin.z() + t * direction.z();
    if (std::abs(x) < kTableHalfWidth && z > kTableBack && z < kTableFront) {
      hit.distance = t;
      hit.normal = Vector3d::UnitY();
      hit.color = wood(x, z);
    }
  }
  for (const Box& b : boxes_) meet(b, origin, direction, hit);
  for (const Cylinder& c : cylinders_) meet(c, origin, direction, hit);
  if (hit.distance == kFar) return std::nullopt;
  return hit;
}

bool RayScene::blocked(const Vector3d& from, const Vector3d& to) const {
  const Vector3d d = to - from;
  Hit hit;
  hit.distance = 1.0;
  for (const Box& b : boxes_) meet(b, from, d, hit);
  for (const Cylinder& c : cylinders_) meet(c, from, d, hit);
  return hit.distance < 1.0;
}

}  // namespace mimesis::camera
