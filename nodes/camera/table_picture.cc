#include "nodes/camera/table_picture.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace mimesis::camera {
namespace {

using Eigen::Vector3d;

constexpr double kNear = 1e-6;
constexpr double kTableHalfWidth = 1.6, kTableBack = -0.62, kTableFront = 1.2;  // [m]

/// Smooth pseudo-random function of one variable, in [-1, 1].
double wave(double t) {
  return 0.5 * std::sin(t) + 0.3 * std::sin(2.3 * t + 1.7) + 0.2 * std::sin(5.1 * t + 0.4);
}

const Bgr kSteel(150.0f, 146.0f, 142.0f);
const Bgr kPlaster(186.0f, 190.0f, 194.0f);
constexpr double kCap = 0.02;  // height of a stand's coloured cap [m]

/// Draws from [0, 1) the same on every platform.
double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11) * 0x1.0p-53; }

void add_stand(RayScene& scene, double x, double y, double radius, const Bgr& color) {
  scene.add_cylinder({x, 0.0, 0.0}, radius * 0.97, y - kCap, kPlaster, kPlaster);
  scene.add_cylinder({x, y - kCap, 0.0}, radius, kCap, color, color);
}

void add_clutter(RayScene& scene, const Clutter& clutter) {
  std::mt19937_64 random(clutter.seed);
  for (int i = 0; i < clutter.count; ++i) {
    const double x = -0.6 + 1.2 * uniform(random);
    const double z = uniform(random) < 0.6 ? -0.2 - 0.35 * uniform(random)   // behind the scene
                                           : 0.22 + 0.10 * uniform(random);  // in front of it
    Bgr color;
    for (int k = 0; k < 3; ++k) color[k] = static_cast<float>(40.0 + 190.0 * uniform(random));
    if (i < clutter.like_skin) color = (0.8f + 0.001f * color[0]) * clutter.skin;
    const double height = 0.006 + 0.02 * uniform(random), radius = 0.005 + 0.006 * uniform(random);
    scene.add_cylinder({x, 0.0, z}, radius, height, color, color);
  }
}

RayScene build(const TeacherTable& t, const Room& room, const Clutter& clutter) {
  RayScene scene(room);
  if (!t.bar_removed) {
    scene.add_box({0.0, t.bar_height_m + 0.5 * t.bar_thickness_m, 0.0},
                  {0.5 * t.bar_width_m, 0.5 * t.bar_thickness_m, t.bar_half_span_m}, t.paints.bar);
  }
  for (const double side : {-1.0, 1.0}) {
    const double z = side * (t.bar_half_span_m - 0.012);
    scene.add_cylinder({0.0, 0.0, z}, 0.026, 0.006, kSteel, kSteel);
    scene.add_cylinder({0.0, 0.0, z}, 0.008, t.bar_height_m, kSteel, kSteel);
  }
  add_stand(scene, t.goal_low_x_m, t.goal_low_y_m, t.goal_radius_m, t.paints.goal_low);
  add_stand(scene, t.goal_high_x_m, t.goal_high_y_m, t.goal_radius_m, t.paints.goal_high);
  add_clutter(scene, clutter);
  return scene;
}

/// Share of the lamp, a square of 0.4 m seen from `point`, that is not hidden, sampled at 4 places.
float lamp_share(const RayScene& scene, const Vector3d& point, double jitter_x, double jitter_z) {
  std::array<Vector3d, 4> lamp;
  for (int k = 0; k < 4; ++k) {
    const Vector3d offset(0.2 * (k % 2 + jitter_x) - 0.2, 0.0, 0.2 * (k / 2 + jitter_z) - 0.2);
    lamp.at(static_cast<std::size_t>(k)) = scene.room().lamp_m + offset;
  }
  return 0.25f * static_cast<float>(scene.seen_from(point, lamp));
}

/// The wall behind the table, seen along `direction`.
Bgr wall(const Vector3d& direction) {
  const double up = direction.normalized().y();
  const double aside = direction.normalized().x() + 0.45;
  const double glow = std::exp(-4.0 * aside * aside);
  return Bgr(150.0f, 150.0f, 148.0f) * static_cast<float>(0.92 + 0.35 * up + 0.16 * glow);
}

}  // namespace

Bgr Room::table_top(double x, double z) const {
  const double row = std::floor(z / plank_m);
  const double across = z / plank_m - row;
  const double bend = 0.012 * wave(3.0 * x + 7.0 * row);
  const double rings = wave(210.0 * (z + bend) + 11.0 * row) * (0.6 + 0.4 * wave(9.0 * x + row));
  const double fibre = wave(900.0 * z + 40.0 * wave(2.0 * x + row));
  const double tone = 1.0 + grain * (0.06 * wave(12.9 * row) + 0.045 * rings + 0.015 * fibre);
  const double joint = std::min(across, 1.0 - across) * plank_m < 0.0012 ? 0.72 : 1.0;
  return wood * static_cast<float>(tone * joint);
}

void RayScene::add_box(const Vector3d& center, const Vector3d& half_extent, const Bgr& color) {
  boxes_.push_back({center, half_extent, color});
  top_m_ = std::max(top_m_, center.y() + half_extent.y());
}

void RayScene::add_cylinder(const Vector3d& base, double radius, double height, const Bgr& side,
                            const Bgr& top) {
  cylinders_.push_back({base, radius, height, side, top});
  top_m_ = std::max(top_m_, base.y() + height);
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
  const double a = d.x() * d.x() + d.z() * d.z();
  const double b = ox * d.x() + oz * d.z();
  const double root = b * b - a * (ox * ox + oz * oz - c.radius * c.radius);
  if (root < 0.0) return;  // seen from above, the ray passes by: most do
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
  if (root == 0.0) return;
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
  if (room_ && t > kNear) {
    const double x = origin.x() + t * direction.x(), z = origin.z() + t * direction.z();
    if (std::abs(x) < kTableHalfWidth && z > kTableBack && z < kTableFront) {
      hit.distance = t;
      hit.normal = Vector3d::UnitY();
      hit.color = room_->table_top(x, z);
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

int RayScene::seen_from(const Vector3d& from, std::span<const Vector3d, 4> to) const {
  // Below the highest thing a ray to a lamp goes aside by no more than this.
  double aside = 0.0;
  for (const Vector3d& end : to) {
    const double rise = end.y() - from.y();
    const double part = rise > 0.0 ? std::clamp((top_m_ - from.y()) / rise, 0.0, 1.0) : 1.0;
    aside = std::max(aside, part * std::hypot(end.x() - from.x(), end.z() - from.z()));
  }
  std::array<double, 4> nearest;
  nearest.fill(1.0);
  Hit hit;
  const auto meet_all = [&](const auto& thing) {
    for (std::size_t k = 0; k < to.size(); ++k) {
      hit.distance = nearest[k];
      meet(thing, from, to[k] - from, hit);
      nearest[k] = hit.distance;
    }
  };
  for (const Box& b : boxes_) meet_all(b);
  for (const Cylinder& c : cylinders_) {
    const double reach = c.radius + aside + 1e-6;
    const double dx = c.base.x() - from.x(), dz = c.base.z() - from.z();
    if (dx * dx + dz * dz < reach * reach) meet_all(c);
  }
  return static_cast<int>(std::ranges::count(nearest, 1.0));
}

float lambert(const Vector3d& normal, const Vector3d& to_lamp) {
  return 0.58f + 0.58f * static_cast<float>(std::max(0.0, normal.dot(to_lamp)));
}

TablePicture draw_table(const TeacherTable& table, const image::Camera& camera, const Room& room,
                        const Clutter& clutter) {
  return draw_scene(build(table, room, clutter), camera);
}

TablePicture draw_scene(const RayScene& scene, const image::Camera& camera) {
  const auto pixels =
      static_cast<std::size_t>(camera.width()) * static_cast<std::size_t>(camera.height());
  TablePicture out{scene.room(), image::Image(camera.width(), camera.height()),
                   std::vector<float>(pixels), std::vector<std::uint8_t>(pixels)};
  std::size_t i = 0;
  for (int v = 0; v < camera.height(); ++v) {
    for (int u = 0; u < camera.width(); ++u, ++i) {
      Bgr sum = Bgr::Zero();
      float depth = 1e9f;
      int wood_samples = 0;
      for (int k = 0; k < 4; ++k) {
        const double du = 0.25 + 0.5 * (k % 2), dv = 0.25 + 0.5 * (k / 2);
        const Vector3d ray = camera.ray(u - 0.5 + du, v - 0.5 + dv);
        const auto hit = scene.trace(camera.eye(), ray);
        if (!hit) {
          sum += wall(ray);
          continue;
        }
        const Vector3d point = camera.eye() + hit->distance * ray + 1e-5 * hit->normal;
        const float light = lambert(hit->normal, (scene.room().lamp_m - point).normalized());
        const float shadow = 0.55f + 0.45f * lamp_share(scene, point, du, dv);
        sum += hit->color * (light * shadow);
        depth = std::min(depth, static_cast<float>(hit->distance));
        wood_samples += point.y() < 1e-4 ? 1 : 0;
      }
      std::uint8_t* pixel = out.color.at(u, v);
      for (int c = 0; c < 3; ++c) {
        pixel[c] = static_cast<std::uint8_t>(std::clamp(0.25f * sum[c], 0.0f, 255.0f));
      }
      out.depth[i] = depth;
      out.wood[i] = wood_samples >= 2 ? 1 : 0;
    }
  }
  return out;
}

}  // namespace mimesis::camera
