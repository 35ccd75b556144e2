#pragma once
#include <bit>
#include <cmath>
#include <cstdint>

#include "nodes/crowd/engine/lanes.h"
#include "nodes/crowd/engine/steer.h"

/// Parts of `steer`, for the instruction set of who calls them.
namespace mimesis::crowd::rows {

/// e^x of x ≤ 0, to 2e-7; 0 below -80.
MIMESIS_PART float exp_lane(float x) {
  constexpr float kMagic = 12582912.0F;  // 1.5·2²³; its low bits take n
  const float y = x > -80.0F ? x : -80.0F;
  const float n = (y * 1.44269504F + kMagic) - kMagic;
  const float r = (y - n * 0.693359375F) + n * 2.12194440e-4F;
  float p = 1.0F / 720.0F;
  p = p * r + 1.0F / 120.0F;
  p = p * r + 1.0F / 24.0F;
  p = p * r + 1.0F / 6.0F;
  p = p * r + 0.5F;
  p = p * r + 1.0F;
  p = p * r + 1.0F;
  const auto bits = (std::bit_cast<std::uint32_t>(n + kMagic) + 127U) << 23U;
  return p * std::bit_cast<float>(bits);
}

/// θ² of cos θ, θ in [0, π], to 7e-5 of θ [Abramowitz, Stegun, 4.4.45].
MIMESIS_PART float squared_angle(float cosine) {
  const float c = cosine < 0.0F ? -cosine : cosine;
  const float rest = 1.0F - c;
  const float root = std::sqrt(rest > 0.0F ? rest : 0.0F);
  const float front = root * (((-0.0187293F * c + 0.0742610F) * c - 0.2121144F) * c + 1.5707288F);
  const float theta = cosine < 0.0F ? 3.14159265F - front : front;
  return theta * theta;
}

/// `steer`.
MIMESIS_PART float steer_around(const Surroundings& around, const Steered& self,
                                const SteerParams& p) {
  constexpr int kLanes = Surroundings::kLanes;
  float sum[kLanes] = {};
  // By value: in the loop nothing may be read from where `sum` could be.
  const float x = self.x, y = self.y, vx = self.vx, vy = self.vy;
  const float per_angle = p.angle, per_distance = p.distance, per_time = p.per_horizon;
  const float cos_right = p.cos_right, sin_right = p.sin_right, reach2 = p.reach2;
  const float avoid_gain = p.avoid, predict_gain = p.predict;
  // The heading less the angle by which others stand further left.
  const float hx = self.cos_heading * p.cos_right + self.sin_heading * p.sin_right;
  const float hy = self.sin_heading * p.cos_right - self.cos_heading * p.sin_right;
  for (int k = 0; k < around.count; k += kLanes) {
    const float *ox = around.x + k, *oy = around.y + k, *ovx = around.vx + k, *ovy = around.vy + k;
    for (int l = 0; l < kLanes; ++l) {
      const float rx = ox[l] - x, ry = oy[l] - y;
      const float d2 = rx * rx + ry * ry;
      const bool near = (d2 < reach2) & (d2 > 1e-12F);
      const float per_d = 1.0F / std::sqrt(d2 + 1e-20F);
      const float sine = (hy * rx - hx * ry) * per_d, cosine = (hx * rx + hy * ry) * per_d;
      const float avoid = sine * exp_lane(-(squared_angle(cosine) * per_angle + d2 * per_distance));

      const float wx = ovx[l] - vx, wy = ovy[l] - vy;
      const float w2 = wx * wx + wy * wy, rw = rx * wx + ry * wy;
      const bool ahead = (w2 > 1e-12F) & (rw < 0.0F);
      const float time = -rw / (w2 + 1e-20F);
      const float cx = rx + time * wx, cy = ry + time * wy;          // closest
      const float qx = rx + time * ovx[l], qy = ry + time * ovy[l];  // where the other is then
      const float q2 = qx * qx + qy * qy;
      const bool here = q2 < 1e-12F;  // it comes to where the agent stands: as if straight ahead
      const float per_q = 1.0F / std::sqrt(q2 + 1e-20F);
      const float there_sine = here ? -sin_right : (hy * qx - hx * qy) * per_q;
      const float there_cosine = here ? cos_right : (hx * qx + hy * qy) * per_q;
      const float predict =
          there_sine * exp_lane(-(squared_angle(there_cosine) * per_angle +
                                  (cx * cx + cy * cy) * per_distance + time * per_time));
      const float both = avoid_gain * avoid + (ahead ? predict_gain * predict : 0.0F);
      sum[l] += near ? both : 0.0F;
    }
  }
  float total = 0.0F;
  for (int l = 0; l < kLanes / 2; ++l) sum[l] += sum[l + kLanes / 2];
  for (int l = 0; l < kLanes / 4; ++l) sum[l] += sum[l + kLanes / 4];
  total = (sum[0] + sum[2]) + (sum[1] + sum[3]);
  return total;
}

}  // namespace mimesis::crowd::rows
