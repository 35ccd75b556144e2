#include "common/image/rig.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "common/error.h"

namespace mimesis::image {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Distorted (x, y) at depth 1; its derivative by (x, y), too.
Vector2d distort(const std::array<double, 5>& k, const Vector2d& p, Matrix2d* derivative) {
  const double x = p.x(), y = p.y(), r2 = x * x + y * y;
  const double c = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
  if (derivative != nullptr) {
    const double dc = 2.0 * (k[0] + r2 * (2.0 * k[1] + r2 * 3.0 * k[4]));  // dc/dx = x dc
    const double mixed = x * y * dc + 2.0 * k[2] * x + 2.0 * k[3] * y;
    *derivative << c + x * x * dc + 2.0 * k[2] * y + 6.0 * k[3] * x, mixed, mixed,
        c + y * y * dc + 6.0 * k[2] * y + 2.0 * k[3] * x;
  }
  return {x * c + 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x),
          y * c + k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y};
}

bool straight(const Lens& lens) {
  return std::ranges::all_of(lens.distortion, [](double k) { return k == 0.0; });
}

Lens lens_of(const View& view) {
  return {view.width_px,
          view.height_px,
          view.focal_px,
          view.focal_px,
          0.5 * (view.width_px - 1),
          0.5 * (view.height_px - 1),
          {}};
}

/// Derivative of a camera's pixel by the point in T.
Eigen::Matrix<double, 2, 3> pixel_derivative(const Camera& camera, const Vector3d& p_T) {
  const Vector3d p = camera.in_camera(p_T);
  Matrix2d bend;
  distort(camera.lens().distortion, p.head<2>() / p.z(), &bend);
  Eigen::Matrix<double, 2, 3> perspective;
  perspective << 1.0 / p.z(), 0.0, -p.x() / (p.z() * p.z()), 0.0, 1.0 / p.z(),
      -p.y() / (p.z() * p.z());
  return Vector2d(camera.lens().fx_px, camera.lens().fy_px).asDiagonal() * bend * perspective *
         camera.R_CT();
}

}  // namespace

Vector2d Lens::project(const Vector3d& p_C) const {
  if (straight(*this)) {
    return {cx_px + fx_px * p_C.x() / p_C.z(), cy_px + fy_px * p_C.y() / p_C.z()};
  }
  const Vector2d bent = distort(distortion, p_C.head<2>() / p_C.z(), nullptr);
  return {cx_px + fx_px * bent.x(), cy_px + fy_px * bent.y()};
}

Vector2d Lens::normalized(const Vector2d& pixel) const {
  const Vector2d bent((pixel.x() - cx_px) / fx_px, (pixel.y() - cy_px) / fy_px);
  if (straight(*this)) return bent;
  Vector2d p = bent;
  for (int i = 0; i < 30; ++i) {  // Newton; 4 or 5 steps are usual
    Matrix2d derivative;
    const Vector2d error = distort(distortion, p, &derivative) - bent;
    const Vector2d step = derivative.inverse() * error;
    p -= step;
    if (step.squaredNorm() < 1e-24) break;
  }
  return p;
}

bool Lens::folds() const {
  constexpr int kDirections = 64;
  constexpr double kStep = 0.005, kFar = 10.0;  // 84° off the axis
  for (int i = 0; i < kDirections; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / kDirections;
    const Vector2d direction(std::cos(angle), std::sin(angle));
    bool inside = true;
    for (double r = 0.0; inside; r += kStep) {
      Matrix2d derivative;
      const Vector2d bent = distort(distortion, r * direction, &derivative);
      const double u = cx_px + fx_px * bent.x(), v = cy_px + fy_px * bent.y();
      inside = u > -0.5 && v > -0.5 && u < width_px - 0.5 && v < height_px - 0.5;
      if (inside && (!(derivative.determinant() > 0.0) || r > kFar)) return true;
    }
  }
  return false;
}

Camera::Camera(const Lens& lens, Matrix3d R_CT, Vector3d p_TC)
    : lens_(lens), r_ct_(std::move(R_CT)), eye_(std::move(p_TC)) {}

Camera::Camera(const View& view)
    : lens_(lens_of(view)), eye_(view.eye_m.at(0), view.eye_m.at(1), view.eye_m.at(2)) {
  const Vector3d axis =
      Vector3d(view.target_m.at(0), view.target_m.at(1), view.target_m.at(2)) - eye_;
  const Vector3d side = axis.cross(Vector3d::UnitY());
  if (side.norm() < 1e-6)
    throw ConfigError("view: eye_m and target_m must differ, and not only in height (y)");
  const Vector3d forward = axis.normalized(), right = side.normalized();
  r_ct_.row(0) = right;
  r_ct_.row(1) = forward.cross(right);
  r_ct_.row(2) = forward;
}

Vector3d Camera::ray(double u, double v) const {
  const Vector2d p = lens_.normalized({u, v});
  return r_ct_.transpose() * Vector3d(p.x(), p.y(), 1.0);
}

std::optional<Vector2d> Camera::on_plane(double u, double v) const {
  const Vector3d d = ray(u, v);
  const double t = -eye_.z() / d.z();
  if (!(t > 0.0) || t > 1e6) return std::nullopt;
  return (eye_ + t * d).head<2>();
}

std::optional<Triangulated> triangulate(std::span<const Sighting> sightings) {
  constexpr double kParallel = 3e-6;  // squared sine of 0.1°
  Matrix3d normal = Matrix3d::Zero();
  Vector3d right = Vector3d::Zero();
  double widest = 0.0;
  Vector3d first = Vector3d::Zero();
  for (const Sighting& s : sightings) {
    const Vector3d d = s.camera->ray(s.pixel.x(), s.pixel.y()).normalized();
    const Matrix3d across = Matrix3d::Identity() - d * d.transpose();
    normal += across;
    right += across * s.camera->eye();
    if (first.isZero()) first = d;
    widest = std::max(widest, first.cross(d).squaredNorm());
  }
  if (!(widest > kParallel)) return std::nullopt;
  Vector3d p = normal.inverse() * right;
  Triangulated out{};
  for (int i = 0; i < 10; ++i) {
    Matrix3d information = Matrix3d::Zero();
    Vector3d gradient = Vector3d::Zero();
    double squares = 0.0;
    for (const Sighting& s : sightings) {
      if (!(s.camera->depth(p) > 0.0)) return std::nullopt;
      const double weight = 1.0 / (s.sigma_px * s.sigma_px);
      const auto j = pixel_derivative(*s.camera, p);
      const Vector2d error = s.pixel - s.camera->project(p);
      information += weight * j.transpose() * j;
      gradient += weight * j.transpose() * error;
      squares += error.squaredNorm();
    }
    out.covariance_m2 = information.inverse();
    out.residual_px = std::sqrt(squares / (2.0 * static_cast<double>(sightings.size())));
    const Vector3d step = out.covariance_m2 * gradient;
    if (!step.allFinite()) return std::nullopt;
    p += step;
    if (step.squaredNorm() < 1e-24) break;
  }
  out.p_T = p;
  return out;
}

double epipolar_distance(const Camera& a, const Camera& b, const Vector2d& pixel_a,
                         const Vector2d& pixel_b) {
  const auto one_side = [](const Camera& from, const Camera& to, const Vector2d& pixel_from,
                           const Vector2d& pixel_to) {
    // Plane of the ray and the baseline, as seen by the other camera: n · (x, y, 1) = 0.
    const Vector3d n =
        to.R_CT() * (from.eye() - to.eye()).cross(from.ray(pixel_from.x(), pixel_from.y()));
    const Vector2d at = to.lens().normalized(pixel_to);
    const Vector2d slope(n.x() / to.lens().fx_px, n.y() / to.lens().fy_px);
    return std::abs(n.x() * at.x() + n.y() * at.y() + n.z()) / slope.norm();
  };
  return 0.5 * (one_side(a, b, pixel_a, pixel_b) + one_side(b, a, pixel_b, pixel_a));
}

Rectification::Rectification(const Camera& left, const Camera& right) : cameras_{left, right} {
  const Vector3d baseline = right.eye() - left.eye();
  baseline_ = baseline.norm();
  const Vector3d forward = left.R_CT().row(2).transpose() + right.R_CT().row(2).transpose();
  const Vector3d down = forward.cross(baseline);
  if (!(down.norm() > 0.1 * forward.norm() * baseline_)) {
    throw ConfigError("rectification: the cameras stand at one place or one behind the other");
  }
  r_nt_.row(0) = baseline.normalized();
  r_nt_.row(1) = down.normalized();
  // Rows run along the left camera's, so that the picture is not upside down.
  if (r_nt_.row(0).dot(left.R_CT().row(0)) < 0.0) r_nt_.topRows<2>() *= -1.0;
  r_nt_.row(2) = r_nt_.row(0).cross(r_nt_.row(1));
  // Both pictures fit in whole: the box around their borders, which the lens bends, at depth 1.
  Eigen::AlignedBox2d box;
  for (const Camera& camera : cameras_) {
    const double right_edge = camera.width() - 1, lower_edge = camera.height() - 1;
    constexpr int kPieces = 16;
    for (int i = 0; i <= kPieces; ++i) {
      const double u = right_edge * i / kPieces, v = lower_edge * i / kPieces;
      for (const auto& [x, y] : {std::pair{u, 0.0}, {u, lower_edge}, {0.0, v}, {right_edge, v}}) {
        box.extend((r_nt_ * camera.ray(x, y)).hnormalized());
      }
    }
  }
  focal_ = std::min((left.width() - 1) / box.sizes().x(), (left.height() - 1) / box.sizes().y());
  cx_ = 0.5 * (left.width() - 1) - focal_ * box.center().x();
  cy_ = 0.5 * (left.height() - 1) - focal_ * box.center().y();
}

Vector2d Rectification::rectified(int side, const Vector2d& pixel) const {
  const Vector3d d = r_nt_ * cameras_.at(static_cast<std::size_t>(side)).ray(pixel.x(), pixel.y());
  return {cx_ + focal_ * d.x() / d.z(), cy_ + focal_ * d.y() / d.z()};
}

Vector2d Rectification::original(int side, const Vector2d& rectified) const {
  const Camera& camera = cameras_.at(static_cast<std::size_t>(side));
  const Vector3d d((rectified.x() - cx_) / focal_, (rectified.y() - cy_) / focal_, 1.0);
  return camera.lens().project(camera.R_CT() * (r_nt_.transpose() * d));
}

const RigCamera* Rig::find(const std::string& name) const {
  const auto it = std::ranges::find(cameras, name, &RigCamera::name);
  return it == cameras.end() ? nullptr : &*it;
}

}  // namespace mimesis::image
