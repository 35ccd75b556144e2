#include "nodes/walker/pattern/standing.h"

#include <algorithm>

namespace mimesis::walker {

Standing::Standing(double height_m)
    : gain_(preview_gains({.height_m = height_m, .samples = 1, .jerk_weight = 1e-4}).K) {}

ComState Standing::after(ComState com, const Eigen::Vector2d& middle, int ticks) const {
  for (int i = 0; i < ticks; ++i) {
    const Eigen::Vector2d error = com.p_W_m - middle;
    if (com.a_W.isZero(0.0) && com.v_W.isZero(0.0) && error.isZero(0.0)) break;
    if (error.norm() + com.v_W.norm() + com.a_W.norm() < 1e-9) {  // no endless small numbers
      com = {.p_W_m = middle};
      break;
    }
    com = advance(com, -(gain_(0) * error + gain_(1) * com.v_W + gain_(2) * com.a_W), kTick_s);
  }
  return com;
}

bool Standing::settled(const ComState& com, const Eigen::Vector2d& middle) {
  return (com.p_W_m - middle).norm() < 0.015 && com.v_W.norm() < 0.03 && com.a_W.norm() < 0.2;
}

double left_share(const PatternSample& sample) {
  if (!sample.contact[kLeft]) return 0.0;
  if (!sample.contact[kRight]) return 1.0;
  const Eigen::Vector2d right = sample.foot[kRight].X_WS.translation().head<2>();
  const Eigen::Vector2d across = sample.foot[kLeft].X_WS.translation().head<2>() - right;
  return std::clamp((sample.zmp_W_m - right).dot(across) / across.squaredNorm(), 0.0, 1.0);
}

}  // namespace mimesis::walker
