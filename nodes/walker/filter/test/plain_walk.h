#pragma once
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Feet side by side as in half-sitting.
inline std::array<Footprint, 2> stance(const robot::Biped& biped) {
  const double y = 0.5 * biped.feet_distance_m;
  return {Footprint{.side = kLeft, .p_W_m = {0.0, y}},
          Footprint{.side = kRight, .p_W_m = {0.0, -y}}};
}

inline Wish wish(double forward_m_s, double left_m_s = 0.0, double yaw_rate_rad_s = 0.0) {
  Wish out;
  out.velocity_m_s = {forward_m_s, left_m_s};
  out.yaw_rate_rad_s = yaw_rate_rad_s;
  return out;
}

}  // namespace mimesis::walker
