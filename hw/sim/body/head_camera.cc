#include "hw/sim/body/head_camera.h"

#include <algorithm>
#include <cmath>

namespace mimesis::hw::sim {
namespace {

using Eigen::Vector3d;

constexpr double kRounding_s = 1e-9;

/// Distance of a point from the line of sight between two others.
double from_line(const Vector3d& p, const Vector3d& from, const Vector3d& to) {
  const Vector3d line = to - from;
  const double share = std::clamp((p - from).dot(line) / line.squaredNorm(), 0.0, 1.0);
  return (p - from - share * line).norm();
}

}  // namespace

HeadCamera::HeadCamera(const HeadCameraSettings& settings)
    : settings_(settings), random_(settings.seed) {
  Eigen::Matrix3d R_HC;  // level: z forward, x right, y down
  R_HC << 0.0, 0.0, 1.0, -1.0, 0.0, 0.0, 0.0, -1.0, 0.0;
  X_HC_.linear() = Eigen::AngleAxisd(settings.down_rad, Vector3d::UnitY()) * R_HC;
  X_HC_.translation() << settings.ahead_m, 0.0, settings.above_m;
}

bool HeadCamera::in_view(const Vector3d& p_C_m) const {
  return p_C_m.z() > 0.0 &&
         std::abs(std::atan2(p_C_m.x(), p_C_m.z())) <= settings_.half_width_rad &&
         std::abs(std::atan2(p_C_m.y(), p_C_m.z())) <= settings_.half_height_rad;
}

std::optional<Vector3d> HeadCamera::find(const Scene& scene, const Vector3d& p_W_m) {
  // drawn whether it is seen or not: what a hand hides does not change the noise of the rest
  Vector3d noise;
  for (double& n : noise) n = settings_.noise_m * normal_(random_);
  const Vector3d p_H_m = scene.X_WH.inverse() * p_W_m;
  if (!in_view(X_HC_.inverse() * p_H_m)) return std::nullopt;
  const Vector3d lens_W_m = scene.X_WH * X_HC_.translation();
  const bool hidden = std::ranges::any_of(scene.hand_W_m, [&](const Vector3d& hand_W_m) {
    return from_line(hand_W_m, lens_W_m, p_W_m) < settings_.hand_radius_m;
  });
  if (hidden) return std::nullopt;
  return p_H_m + noise;
}

void HeadCamera::look(double time_s, const Scene& scene) {
  if (!first_s_) first_s_ = time_s;
  const double due_s = *first_s_ + static_cast<double>(taken_) / settings_.rate_hz;
  if (time_s < due_s - kRounding_s) return;
  HeadSight& sight = sight_[taken_ % kMost];
  sight.taken_s = time_s;
  sight.handle_H_m = find(scene, scene.handle_W_m);
  sight.object_H_m = find(scene, scene.object_W_m);
  ++taken_;
}

const HeadSight* HeadCamera::arrived(double time_s) {
  if (given_ == taken_) return nullptr;
  const HeadSight& sight = sight_[given_ % kMost];
  if (time_s < sight.taken_s + settings_.delay_s - kRounding_s) return nullptr;
  ++given_;
  return &sight;
}

}  // namespace mimesis::hw::sim
