#include "nodes/vision/silhouette.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mimesis::vision {
namespace {

using Eigen::Vector2d;

double cross(const Vector2d& o, const Vector2d& a, const Vector2d& b) {
  return (a - o).x() * (b - o).y() - (a - o).y() * (b - o).x();
}

/// Convex hull by Andrew's monotone chain; `points` gets sorted.
std::vector<Vector2d> hull(std::vector<Vector2d>& points) {
  std::sort(points.begin(), points.end(), [](const Vector2d& a, const Vector2d& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  std::vector<Vector2d> out;
  const auto extend = [&out](const Vector2d& p, std::size_t floor) {
    while (out.size() >= floor + 2 && cross(out[out.size() - 2], out.back(), p) <= 0.0)
      out.pop_back();
    out.push_back(p);
  };
  for (const Vector2d& p : points) extend(p, 0);
  const std::size_t lower = out.size() - 1;
  for (auto p = points.rbegin() + 1; p != points.rend(); ++p) extend(*p, lower);
  out.pop_back();
  return out;
}

}  // namespace

Body cylinder(double radius_m, double height_m) {
  constexpr int kPoints = 16;
  Body body;
  for (int k = 0; k < kPoints; ++k) {
    const double a = 2.0 * std::numbers::pi * k / kPoints;
    for (const double side : {-0.5, 0.5}) {
      body.emplace_back(radius_m * std::cos(a), side * height_m, radius_m * std::sin(a));
    }
  }
  return body;
}

Body box(double width_m, double height_m, double depth_m) {
  Body body;
  for (int k = 0; k < 8; ++k) {
    body.emplace_back((k & 1 ? 0.5 : -0.5) * width_m, (k & 2 ? 0.5 : -0.5) * height_m,
                      (k & 4 ? 0.5 : -0.5) * depth_m);
  }
  return body;
}

Vector2d silhouette_centroid(const image::Pinhole& camera, const Body& body,
                             const Vector2d& center_m) {
  std::vector<Vector2d> points;
  points.reserve(body.size());
  for (const Eigen::Vector3d& p : body) {
    points.push_back(camera.project(p + Eigen::Vector3d(center_m.x(), center_m.y(), 0.0)));
  }
  const std::vector<Vector2d> outline = hull(points);
  Vector2d sum = Vector2d::Zero();
  double area = 0.0;
  for (std::size_t i = 1; i + 1 < outline.size(); ++i) {  // fan of triangles
    const double part = cross(outline[0], outline[i], outline[i + 1]);
    sum += part * (outline[0] + outline[i] + outline[i + 1]) / 3.0;
    area += part;
  }
  return sum / area;
}

std::optional<Vector2d> locate(const image::Pinhole& camera, const Body& body,
                               const Vector2d& pixel) {
  std::optional<Vector2d> center = camera.on_plane(pixel.x(), pixel.y());
  for (int i = 0; i < 6 && center; ++i) {
    if (camera.depth({center->x(), center->y(), 0.0}) < 0.2) return std::nullopt;
    const Vector2d predicted = silhouette_centroid(camera, body, *center);
    const auto from = camera.on_plane(predicted.x(), predicted.y());
    const auto to = camera.on_plane(pixel.x(), pixel.y());
    if (!from || !to) return std::nullopt;
    *center += *to - *from;
    if ((*to - *from).norm() < 1e-5) break;
  }
  return center;
}

}  // namespace mimesis::vision
