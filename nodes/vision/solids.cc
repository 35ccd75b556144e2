#include "nodes/vision/solids.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace mimesis::vision {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

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

constexpr int kMeasured = 12, kMostUnknown = 6;
using Residual = Eigen::Matrix<double, kMeasured, 1>;
using Unknown = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostUnknown, 1>;

/// x y z, ln of half width and length, yaw of a bar: sizes stay positive.
Unknown unknowns(const Solid& s) {
  Unknown x(s.form == Form::bar ? 6 : 5);
  x.head<3>() = s.center;
  x[3] = std::log(s.half_width);
  x[4] = std::log(s.length);
  if (s.form == Form::bar) x[5] = s.yaw_rad;
  return x;
}

Solid solid_of(const Solid& form, const Unknown& x) {
  Solid s = form;
  s.center = x.head<3>();
  s.half_width = std::exp(x[3]);
  s.length = std::exp(x[4]);
  if (s.form == Form::bar) s.yaw_rad = x[5];
  return s;
}

/// Differences between what a solid would look like and what is seen, in standard deviations.
class Misfit {
 public:
  Misfit(std::span<const image::Camera> cameras, std::span<const Outline> seen, double centroid_px)
      : cameras_(cameras), seen_(seen), centroid_px_(centroid_px) {}

  std::optional<Residual> operator()(const Solid& solid) const {
    constexpr double kEdge = 0.3, kNearest = 0.05;  // [px], [m]
    const Body body = solid.body();
    Residual r;
    for (std::size_t k = 0; k < 2; ++k) {
      for (const Vector3d& p : body) {
        if (!(cameras_[k].depth(solid.center + p) > kNearest)) return std::nullopt;
      }
      const Outline now = outline(cameras_[k], body, solid.center);
      const Outline& seen = seen_[k];
      // A rectangle w wide has the moment w²/12; an edge off by d on both sides changes it by w
      // d/3.
      const double w = std::sqrt(12.0 * seen.spread(0, 0)), h = std::sqrt(12.0 * seen.spread(1, 1));
      auto part = r.segment<6>(6 * static_cast<Eigen::Index>(k));
      part.head<2>() = (now.mean - seen.mean) / centroid_px_;
      part[2] = (now.area - seen.area) / (kEdge * 2.0 * (w + h));
      part[3] = (now.spread(0, 0) - seen.spread(0, 0)) / (kEdge * w / 3.0);
      part[4] = (now.spread(1, 1) - seen.spread(1, 1)) / (kEdge * h / 3.0);
      part[5] = (now.spread(0, 1) - seen.spread(0, 1)) / (kEdge * std::sqrt(w * h) / 3.0);
    }
    return r;
  }

 private:
  std::span<const image::Camera> cameras_;
  std::span<const Outline> seen_;
  double centroid_px_;
};

/// From a first guess to the nearest minimum.
std::optional<FoundSolid> refine(const Solid& guess, const Misfit& misfit) {
  constexpr double kStep = 1e-6, kEnough = 1e-5;
  constexpr int kRounds = 25;
  Unknown x = unknowns(guess);
  auto r = misfit(guess);
  if (!r) return std::nullopt;
  double damping = 1e-3;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kMostUnknown, kMostUnknown> normal;
  for (int round = 0; round < kRounds; ++round) {
    Eigen::Matrix<double, kMeasured, Eigen::Dynamic, 0, kMeasured, kMostUnknown> j(kMeasured,
                                                                                   x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      Unknown beside = x;
      beside[i] += kStep;
      const auto there = misfit(solid_of(guess, beside));
      if (!there) return std::nullopt;
      j.col(i) = (*there - *r) / kStep;
    }
    normal = j.transpose() * j;
    const Unknown slope = j.transpose() * *r;
    bool better = false;
    double gained = 0.0;
    for (int attempt = 0; attempt < 8 && !better; ++attempt) {
      auto damped = normal;
      damped.diagonal() *= 1.0 + damping;
      Unknown next = x - damped.ldlt().solve(slope);
      if (!next.allFinite()) return std::nullopt;
      next[3] = std::clamp(next[3], x[3] - 1.0, x[3] + 1.0);
      next[4] = std::clamp(next[4], x[4] - 1.0, x[4] + 1.0);
      const auto there = misfit(solid_of(guess, next));
      better = there && there->squaredNorm() < r->squaredNorm();
      damping *= better ? 0.2 : 8.0;
      if (!better) continue;
      gained = r->squaredNorm() - there->squaredNorm();
      x = next;
      r = there;
    }
    if (!better || gained < kEnough) break;
  }
  FoundSolid out;
  out.solid = solid_of(guess, x);
  out.misfit = std::sqrt(r->squaredNorm() / kMeasured);
  const Eigen::FullPivLU<Eigen::MatrixXd> lu(normal);
  if (!lu.isInvertible()) return std::nullopt;
  out.covariance_m2 = lu.inverse().topLeftCorner<3, 3>();
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

Outline outline(const image::Camera& camera, const Body& body, const Vector3d& center_T) {
  std::vector<Vector2d> points;
  points.reserve(body.size());
  for (const Vector3d& p : body) points.push_back(camera.project(center_T + p));
  const std::vector<Vector2d> border = hull(points);
  // Moments of triangles about their common corner: ∫ x xᵀ = A/12 (a aᵀ + b bᵀ + (a + b)(a + b)ᵀ).
  const Vector2d& origin = border[0];
  double area = 0.0;
  Vector2d first = Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (std::size_t i = 1; i + 1 < border.size(); ++i) {
    const Vector2d a = border[i] - origin, b = border[i + 1] - origin, sum = a + b;
    const double part = 0.5 * (a.x() * b.y() - a.y() * b.x());
    area += part;
    first += part / 3.0 * sum;
    second += part / 12.0 * (a * a.transpose() + b * b.transpose() + sum * sum.transpose());
  }
  const Vector2d mean = first / area;
  return {area, origin + mean, second / area - mean * mean.transpose()};
}

std::optional<Vector2d> locate(const image::Camera& camera, const Body& body,
                               const Vector2d& pixel) {
  std::optional<Vector2d> center = camera.on_plane(pixel.x(), pixel.y());
  for (int i = 0; i < 6 && center; ++i) {
    const Vector3d at(center->x(), center->y(), 0.0);
    if (camera.depth(at) < 0.2) return std::nullopt;
    const Vector2d predicted = outline(camera, body, at).mean;
    const auto from = camera.on_plane(predicted.x(), predicted.y());
    const auto to = camera.on_plane(pixel.x(), pixel.y());
    if (!from || !to) return std::nullopt;
    *center += *to - *from;
    if ((*to - *from).norm() < 1e-5) break;
  }
  return center;
}

Body Solid::body() const {
  if (form == Form::cylinder) return cylinder(half_width, length);
  if (form == Form::block) return box(2.0 * half_width, length, 2.0 * half_width);
  const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
  Body body = box(length, 2.0 * half_width, 2.0 * half_width * aspect);
  for (Vector3d& p : body) p = {c * p.x() + s * p.z(), p.y(), c * p.z() - s * p.x()};
  return body;
}

std::optional<FoundSolid> fit_solid(const Solid& form, std::span<const image::Camera> cameras,
                                    std::span<const Outline> seen, double centroid_px) {
  const std::array<image::Sighting, 2> sightings{
      {{&cameras[0], seen[0].mean}, {&cameras[1], seen[1].mean}}};
  const auto middle = image::triangulate(sightings);
  if (!middle) return std::nullopt;
  const Misfit misfit(cameras, seen, centroid_px);
  Solid guess = form;
  guess.center = middle->p_T;
  const double scale = cameras[0].scale(guess.center);
  const Eigen::Matrix2d& spread = seen[0].spread;
  if (form.form != Form::bar) {
    guess.half_width = 0.5 * std::sqrt(12.0 * spread(0, 0)) / scale;
    guess.length = std::sqrt(12.0 * spread(1, 1)) / scale;
    return refine(guess, misfit);
  }
  std::optional<FoundSolid> best;
  constexpr int kDirections = 4;
  const double longest = std::sqrt(12.0 * spread.trace());
  for (int k = 0; k < kDirections; ++k) {
    guess.yaw_rad = std::numbers::pi * (k / static_cast<double>(kDirections) - 0.5);
    guess.half_width = 0.5 * seen[0].area / longest / scale;
    guess.length = longest / scale;
    const auto found = refine(guess, misfit);
    if (found && (!best || found->misfit < best->misfit)) best = found;
  }
  if (best) {
    double& yaw = best->solid.yaw_rad;
    yaw = std::remainder(yaw, std::numbers::pi);  // an axis has no head
  }
  return best;
}

}  // namespace mimesis::vision
