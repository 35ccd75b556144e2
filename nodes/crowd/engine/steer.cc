#include "nodes/crowd/engine/steer.h"

#include <cmath>

#include "common/math/vector_clones.h"
#include "nodes/crowd/engine/steer_rows.h"

namespace mimesis::crowd {

void Surroundings::pad() {
  const int end = (count + kLanes - 1) / kLanes * kLanes;
  for (int i = count; i < end; ++i) {
    x[i] = y[i] = 1e9F;
    vx[i] = vy[i] = 0.0F;
  }
}

SteerParams::SteerParams(const dmp::NavigationParams& p, double reach_m)
    : avoid(static_cast<float>(p.avoid_1_s)),
      predict(static_cast<float>(p.predict_1_s)),
      angle(static_cast<float>(0.5 / (p.sigma_angle_rad * p.sigma_angle_rad))),
      distance(static_cast<float>(0.5 / (p.sigma_distance_m * p.sigma_distance_m))),
      per_horizon(static_cast<float>(1.0 / p.horizon_s)),
      cos_right(static_cast<float>(std::cos(p.keep_right_rad))),
      sin_right(static_cast<float>(std::sin(p.keep_right_rad))),
      reach2(static_cast<float>(reach_m * reach_m)) {}

MIMESIS_VECTOR_CLONES
float steer(const Surroundings& around, const Steered& self, const SteerParams& params) {
  return rows::steer_around(around, self, params);
}

}  // namespace mimesis::crowd
