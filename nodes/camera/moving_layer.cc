#include "nodes/camera/moving_layer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

namespace mimesis::camera {
namespace {

using Eigen::Vector3d;

struct Finger {
  double side;                   // side of the knuckle, + towards the thumb [m]
  std::array<double, 3> length;  // proximal, middle, distal [m]
  double radius;                 // at the knuckle [m]
};
constexpr std::array<Finger, 4> kFingers{{
    {0.033, {0.045, 0.027, 0.020}, 0.0100},
    {0.011, {0.049, 0.031, 0.020}, 0.0102},
    {-0.011, {0.045, 0.030, 0.020}, 0.0098},
    {-0.032, {0.038, 0.022, 0.018}, 0.0088},
}};
const Vector3d kShoulder(-1.0, 0.42, -0.15);  // out of view, left of the table
constexpr double kKnuckle = 0.085;            // distance wrist - knuckles [m]

/// Direction of each phalange against the palm [rad]: open and closed.
struct Posture {
  std::array<double, 3> open, closed;
};
constexpr double deg(double d) { return d * std::numbers::pi / 180.0; }
constexpr Posture kPrecision{{deg(32), deg(58), deg(72)}, {deg(58), deg(92), deg(106)}};
constexpr Posture kFull{{deg(10), deg(26), deg(36)}, {deg(55), deg(132), deg(185)}};

using Polyline = std::array<Vector3d, 4>;  // thumb: (along, side, normal) [m]
const Polyline kThumbPrecisionOpen{
    {{0.022, 0.026, 0.008}, {0.048, 0.042, 0.030}, {0.056, 0.040, 0.058}, {0.058, 0.034, 0.076}}};
const Polyline kThumbPrecisionClosed{
    {{0.022, 0.026, 0.008}, {0.044, 0.040, 0.032}, {0.050, 0.030, 0.062}, {0.054, 0.020, 0.086}}};
const Polyline kThumbFullOpen{
    {{0.020, 0.026, 0.006}, {0.044, 0.052, 0.012}, {0.066, 0.066, 0.020}, {0.084, 0.070, 0.030}}};
const Polyline kThumbFullClosed{
    {{0.020, 0.026, 0.006}, {0.044, 0.046, 0.028}, {0.062, 0.044, 0.056}, {0.080, 0.034, 0.072}}};

using Eigen::Vector2d;

constexpr int kCoarse = 4;  // the shadow is drawn at a quarter of the resolution

std::size_t area(int width, int height) {
  return static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
}

struct Window {
  int u0, u1, v0, v1;  // half open
};

Window clip(double u0, double u1, double v0, double v1, int width, int height) {
  return {std::max(0, static_cast<int>(std::floor(u0))),
          std::min(width, static_cast<int>(std::ceil(u1)) + 1),
          std::max(0, static_cast<int>(std::floor(v0))),
          std::min(height, static_cast<int>(std::ceil(v1)) + 1)};
}

}  // namespace

void hand_capsules(const TeacherPose& pose, Grip grip, const Looks& looks,
                   std::vector<Capsule>& out) {
  out.clear();
  const Vector3d x = pose.fingers.normalized();
  const Vector3d n = pose.palm_normal.normalized();
  const Vector3d s = (looks.right_hand ? -1.0 : 1.0) * n.cross(x);  // towards the thumb
  const auto point = [&](double along, double side, double normal) -> Vector3d {
    return pose.wrist + pose.scale * along * x + pose.scale * side * s + pose.scale * normal * n;
  };
  const bool precision = grip == Grip::precision;
  const Posture& posture = precision ? kPrecision : kFull;

  const Vector3d end = pose.wrist + looks.bare * (pose.elbow - pose.wrist);
  // of the arm where the sleeve ends: 36 mm at 0.55 of its length
  const double breadth = 0.0255 + (0.036 - 0.0255) * (looks.bare / 0.55);
  out.push_back({kShoulder, pose.elbow, 0.060, 0.050, looks.cloth});
  out.push_back({pose.elbow, end, 0.050, breadth + 0.008, looks.cloth});
  out.push_back({end, pose.wrist, breadth, 0.0255, looks.skin});
  for (const Finger& f : kFingers) {
    out.push_back({point(0.004, 0.55 * f.side, 0.0), point(kKnuckle, f.side, 0.0), 0.0165, 0.0135,
                   looks.skin});
  }
  out.push_back({point(0.02, 0.0, 0.002), point(0.07, 0.0, 0.002), 0.019, 0.017, looks.skin});

  for (const Finger& f : kFingers) {
    // In a precision grip index and middle finger reach the object; the others stay curled beside
    // it.
    const double gather = precision ? 0.45 * pose.closure : 0.0;
    Vector3d from(kKnuckle, f.side, 0.0);
    double radius = f.radius;
    for (std::size_t k = 0; k < 3; ++k) {
      const double angle = posture.open[k] + pose.closure * (posture.closed[k] - posture.open[k]);
      Vector3d to = from + f.length[k] * Vector3d(std::cos(angle), 0.0, std::sin(angle));
      to.y() -= gather * (f.side - 0.011) * f.length[k] / 0.095;
      out.push_back({point(from.x(), from.y(), from.z()), point(to.x(), to.y(), to.z()), radius,
                     0.93 * radius, looks.skin});
      from = to;
      radius *= 0.93;
    }
  }
  const Polyline& open = precision ? kThumbPrecisionOpen : kThumbFullOpen;
  const Polyline& closed = precision ? kThumbPrecisionClosed : kThumbFullClosed;
  double radius = 0.0145;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3d a = open[k] + pose.closure * (closed[k] - open[k]);
    const Vector3d b = open[k + 1] + pose.closure * (closed[k + 1] - open[k + 1]);
    out.push_back({point(a.x(), a.y(), a.z()), point(b.x(), b.y(), b.z()), radius, 0.84 * radius,
                   looks.skin});
    radius *= 0.84;
  }
  for (std::size_t k = 2; k < out.size(); ++k) {
    out[k].radius_a *= pose.scale;
    out[k].radius_b *= pose.scale;
  }
}

std::optional<Capsule> Passer::at(double t_s) const {
  constexpr double kAside = 1.0, kTop = 0.7;  // [m]
  const double way = std::abs(speed_m_s) * (t_s - begin_s);
  if (begin_s < 0.0 || way < 0.0 || way > 2.0 * kAside) return std::nullopt;
  const Vector3d foot(std::copysign(1.0, speed_m_s) * (way - kAside), 0.0, z_m);
  return Capsule{foot, foot + Vector3d(lean * kTop, kTop, 0.0), radius_m, radius_m, color};
}

MovingLayer::MovingLayer(const image::Camera& camera, const TablePicture& table)
    : camera_(camera),
      table_(table),
      shadow_(area(camera.width() / kCoarse, camera.height() / kCoarse)),
      soft_(shadow_.size()),
      large_(area(camera.width(), camera.height())) {}

void MovingLayer::draw(std::span<const Capsule> hand, const MovingCylinder& object,
                       image::Image& image) {
  cast_shadow(hand, object, image);
  depth_ = table_.depth;
  draw_cylinder(object, image);
  for (const Capsule& c : hand) draw_capsule(c, image);
}

void MovingLayer::blend(int u, int v, float depth, float coverage, const Bgr& color,
                        image::Image& image) {
  float& nearest = depth_[area(image.width, v) + static_cast<std::size_t>(u)];
  if (depth >= nearest) return;
  if (coverage > 0.5f) nearest = depth;
  std::uint8_t* pixel = image.at(u, v);
  for (int c = 0; c < 3; ++c) {
    const float mixed = static_cast<float>(pixel[c]) * (1.0f - coverage) + coverage * color[c];
    pixel[c] = static_cast<std::uint8_t>(std::clamp(mixed, 0.0f, 255.0f));
  }
}

void MovingLayer::shadow_disc(const Vector3d& p, double radius) {
  const Vector3d& lamp = table_.room.lamp_m;
  const double t = p.y() / (lamp.y() - p.y());
  const Vector3d ground = p + t * (p - lamp);
  if (camera_.depth(ground) < 0.1) return;
  const Vector2d pixel = camera_.project(ground) / kCoarse;
  const double r = radius * camera_.scale(ground) / kCoarse;
  const double squash = 0.6;  // a disc on the table is foreshortened
  const int width = camera_.width() / kCoarse, height = camera_.height() / kCoarse;
  const Window w = clip(pixel.x() - r, pixel.x() + r, pixel.y() - r, pixel.y() + r, width, height);
  for (int v = w.v0; v < w.v1; ++v) {
    for (int u = w.u0; u < w.u1; ++u) {
      const double du = u - pixel.x(), dv = (v - pixel.y()) / squash;
      if (du * du + dv * dv < r * r) shadow_[area(width, v) + static_cast<std::size_t>(u)] = 255;
    }
  }
}

void MovingLayer::cast_shadow(std::span<const Capsule> hand, const MovingCylinder& object,
                              image::Image& image) {
  std::fill(shadow_.begin(), shadow_.end(), std::uint8_t{0});
  for (const Capsule& c : hand) {
    const int steps = 2 + static_cast<int>((c.b - c.a).norm() / 0.02);
    for (int k = 0; k <= steps; ++k) {
      const double s = static_cast<double>(k) / steps;
      shadow_disc(c.a + s * (c.b - c.a), c.radius_a + s * (c.radius_b - c.radius_a));
    }
  }
  for (const double part : {-0.5, -0.25, 0.0, 0.25, 0.5}) {
    shadow_disc(object.center + Vector3d(0.0, part * object.height, 0.0), object.radius);
  }
  const cv::Size coarse(camera_.width() / kCoarse, camera_.height() / kCoarse);
  const cv::Mat mask(coarse, CV_8U, shadow_.data());
  cv::Mat soft(coarse, CV_8U, soft_.data());
  cv::GaussianBlur(mask, soft, cv::Size(7, 7), 1.6);
  cv::Mat large(cv::Size(camera_.width(), camera_.height()), CV_8U, large_.data());
  cv::resize(soft, large, large.size(), 0.0, 0.0, cv::INTER_LINEAR);
  for (std::size_t i = 0; i < large_.size(); ++i) {
    if (large_[i] == 0 || table_.wood[i] == 0) continue;
    const int keep = 256 - large_[i] * 100 / 256;
    for (std::size_t c = 0; c < 3; ++c) {
      std::uint8_t& value = image.bgr[3 * i + c];
      value = static_cast<std::uint8_t>(value * keep / 256);
    }
  }
}

void MovingLayer::draw_capsule(const Capsule& capsule, image::Image& image) {
  const double za = camera_.depth(capsule.a), zb = camera_.depth(capsule.b);
  if (za < 0.1 || zb < 0.1) return;
  const Vector2d a = camera_.project(capsule.a), b = camera_.project(capsule.b);
  const double ra = capsule.radius_a * camera_.scale(capsule.a);
  const double rb = capsule.radius_b * camera_.scale(capsule.b);
  const Window w = clip(std::min(a.x() - ra, b.x() - rb), std::max(a.x() + ra, b.x() + rb),
                        std::min(a.y() - ra, b.y() - rb), std::max(a.y() + ra, b.y() + rb),
                        image.width, image.height);
  const Vector2d axis = b - a;
  const double inverse = 1.0 / std::max(axis.squaredNorm(), 1e-9);
  const Vector3d middle = 0.5 * (capsule.a + capsule.b);
  const Vector3d to_lamp = camera_.R_CT() * (table_.room.lamp_m - middle).normalized();
  for (int v = w.v0; v < w.v1; ++v) {
    for (int u = w.u0; u < w.u1; ++u) {
      const Vector2d p(u, v);
      const double s = std::clamp((p - a).dot(axis) * inverse, 0.0, 1.0);
      const Vector2d away = p - (a + s * axis);
      const double r = ra + s * (rb - ra);
      if (away.squaredNorm() >= (r + 0.5) * (r + 0.5)) continue;
      const double distance = away.norm();
      const double coverage = std::clamp(r - distance + 0.5, 0.0, 1.0);
      const Vector2d across = away / std::max(r, distance);
      const double bulge = std::sqrt(std::max(0.0, 1.0 - across.squaredNorm()));
      const Vector3d normal(across.x(), across.y(), -bulge);
      const double thickness = capsule.radius_a + s * (capsule.radius_b - capsule.radius_a);
      const auto depth = static_cast<float>(za + s * (zb - za) - thickness * bulge);
      const auto rim = static_cast<float>(0.86 + 0.14 * bulge);
      blend(u, v, depth, static_cast<float>(coverage),
            capsule.color * (rim * lambert(normal, to_lamp)), image);
    }
  }
}

void MovingLayer::draw_cylinder(const MovingCylinder& cylinder, image::Image& image) {
  RayScene scene;
  const Vector3d base = cylinder.center - Vector3d(0.0, 0.5 * cylinder.height, 0.0);
  scene.add_cylinder(base, cylinder.radius, cylinder.height, cylinder.color, 1.1f * cylinder.color);
  if (camera_.depth(cylinder.center) < 0.1) return;
  // Rays aim up to a third of a pixel beside its middle, so the box around the cylinder is all they
  // can hit.
  Eigen::AlignedBox2d seen;
  for (const double x : {-cylinder.radius, cylinder.radius}) {
    for (const double z : {-cylinder.radius, cylinder.radius}) {
      seen.extend(camera_.project(base + Vector3d(x, 0.0, z)));
      seen.extend(camera_.project(base + Vector3d(x, cylinder.height, z)));
    }
  }
  const Window w = clip(seen.min().x() - 1.0, seen.max().x() + 1.0, seen.min().y() - 1.0,
                        seen.max().y() + 1.0, image.width, image.height);
  constexpr int kSide = 3;  // 3 x 3 rays a pixel
  for (int v = w.v0; v < w.v1; ++v) {
    for (int u = w.u0; u < w.u1; ++u) {
      Bgr sum = Bgr::Zero();
      int hits = 0;
      float depth = 0.0f;
      for (int k = 0; k < kSide * kSide; ++k) {
        const Vector3d ray = camera_.ray(u + (k % kSide - 1) / static_cast<double>(kSide),
                                         v + (k / kSide - 1) / static_cast<double>(kSide));
        const auto hit = scene.trace(camera_.eye(), ray);
        if (!hit) continue;
        const Vector3d point = camera_.eye() + hit->distance * ray;
        sum += hit->color * lambert(hit->normal, (table_.room.lamp_m - point).normalized());
        depth += static_cast<float>(hit->distance);
        ++hits;
      }
      if (hits == 0) continue;
      const auto n = static_cast<float>(hits);
      blend(u, v, depth / n, n / (kSide * kSide), sum / n, image);
    }
  }
}

}  // namespace mimesis::camera
