#pragma once
#include <cmath>

#include "common/robot/dynamics.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

inline constexpr double kGravity_m_s2 = robot::kGravity;

/// Cart-table model [Kajita 2003]: a CoM that stays at height h above level ground, moved by its
/// jerk. ZMP z = p − (h/g) p̈ per axis.
inline Eigen::Vector2d zmp(const ComState& com, double height_m) {
  return com.p_W_m - height_m / kGravity_m_s2 * com.a_W;
}

/// Cart-tables are linear: motions add.
inline ComState operator+(const ComState& a, const ComState& b) {
  return {.p_W_m = a.p_W_m + b.p_W_m, .v_W = a.v_W + b.v_W, .a_W = a.a_W + b.a_W};
}

/// The state after a time t [s] of constant jerk j [m/s³].
inline ComState advance(const ComState& com, const Eigen::Vector2d& j, double t) {
  ComState next;
  next.p_W_m = com.p_W_m + t * (com.v_W + t * (com.a_W / 2.0 + t / 6.0 * j));
  next.v_W = com.v_W + t * (com.a_W + t / 2.0 * j);
  next.a_W = com.a_W + t * j;
  return next;
}

/// The state after t seconds in which the ZMP stays where it is: a linear inverted pendulum.
inline ComState with_zmp_at_rest(const ComState& com, double height_m, double t) {
  const double w = std::sqrt(kGravity_m_s2 / height_m), c = std::cosh(w * t), s = std::sinh(w * t);
  const Eigen::Vector2d z = zmp(com, height_m), d = com.p_W_m - z;
  return {.p_W_m = z + c * d + s / w * com.v_W,
          .v_W = w * s * d + c * com.v_W,
          .a_W = w * w * (c * d + s / w * com.v_W)};
}

}  // namespace mimesis::walker
