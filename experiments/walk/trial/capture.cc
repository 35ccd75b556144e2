#include "experiments/walk/trial/capture.h"

#include <cmath>

#include "common/math/so3.h"

namespace mimesis::walk {
namespace {

using Eigen::Vector2d;
using walker::kLeft, walker::kRight, walker::Side;

Vector2d nearest(const Vector2d& p, const Vector2d& low, const Vector2d& high) {
  return p.cwiseMax(low).cwiseMin(high);
}

}  // namespace

Capturability capturability(const robot::Biped& biped, const walker::GaitSettings& gait,
                            const walker::PatternSample& plan, const Vector2d& xi_m,
                            double omega_1_s) {
  const bool both = plan.contact[kLeft] && plan.contact[kRight];
  const Side stance = plan.contact[kLeft] ? kLeft : kRight;
  // In the axes of the foot that stands, or of the left one: x forward.
  const Eigen::Isometry3d X_FW = plan.foot[stance].X_WS.inverse();
  const auto in_foot = [&](const Eigen::Vector3d& p_W) -> Vector2d {
    return (X_FW * p_W).head<2>();
  };
  const auto& leg = biped.leg;
  Vector2d low = leg[stance].min_S_m, high = leg[stance].max_S_m;
  if (both) {
    const Vector2d other = in_foot(plan.foot[robot::other(stance)].X_WS.translation());
    low = low.cwiseMin(other + leg[robot::other(stance)].min_S_m);
    high = high.cwiseMax(other + leg[robot::other(stance)].max_S_m);
  }
  const Vector2d xi = in_foot({xi_m.x(), xi_m.y(), plan.foot[stance].X_WS.translation().z()});
  const Vector2d zmp = nearest(xi, low, high);
  if (zmp == xi) return {.capturable = true};
  if (both || plan.to_landing_s <= 0.0) return {.beyond_m = (xi - zmp).norm()};
  const Vector2d at_landing = zmp + (xi - zmp) * std::exp(omega_1_s * plan.to_landing_s);
  const Side swing = robot::other(stance);
  const double side = robot::sign(swing);
  Vector2d near(-gait.longest_step_m, side * gait.narrowest_step_m),
      far(gait.longest_step_m, side * gait.widest_step_m);
  if (side < 0.0) std::swap(near.y(), far.y());
  const Vector2d reached = nearest(at_landing, near + leg[swing].min_S_m, far + leg[swing].max_S_m);
  const double beyond = (at_landing - reached).norm();
  return {.capturable = beyond == 0.0, .beyond_m = beyond};
}

}  // namespace mimesis::walk
