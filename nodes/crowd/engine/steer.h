#pragma once
#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "nodes/crowd/rules/lanes.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {

/// Others around one agent, in floats relative to a point near it [m, m/s].
struct Surroundings {
  static constexpr int kLanes = 16;
  static constexpr int kBlock = 8;    // copied at a time
  static constexpr int kMost = 1024;  // a multiple of the lanes

  float x[kMost + kBlock], y[kMost + kBlock], vx[kMost + kBlock], vy[kMost + kBlock];
  int count = 0;
  bool full() const { return count == kMost; }
  void add(double x_m, double y_m, float vx_m_s, float vy_m_s) {
    x[count] = static_cast<float>(x_m);
    y[count] = static_cast<float>(y_m);
    vx[count] = vx_m_s;
    vy[count++] = vy_m_s;
  }
  /// Fills the last lanes up to a multiple of 16 with an agent out of reach.
  void pad();
};

/// Others that may bound an agent's velocity, relative to it, and their bounds.
struct Candidates : Surroundings {
  float radius[kMost + kBlock];
  int yields[kMost + kBlock], at[kMost + kBlock];  // place in the grid
  float nx[kMost], ny[kMost], gap[kMost], limit[kMost];
  int heeded[kMost], chosen[kMost];
  int heed = 0;  // how many are chosen
};

struct SteerParams {
  float avoid, predict;   // gains
  float angle, distance;  // 1/(2σ²)
  float per_horizon;
  float cos_right, sin_right;  // angle by which others are assumed to stand to the left
  float reach2;

  SteerParams(const NavigationParams& p, double reach_m);
};

/// The agent that steers: position relative to the same point, velocity, heading.
struct Steered {
  float x, y, vx, vy, cos_heading, sin_heading;
};

/// Sum of the terms of avoidance and of predicted collisions over all others within reach [rad/s;
/// M18 eq. 3.26, 3.27]; an agent at the same point is the agent itself. Agrees with avoidance_term
/// and prediction_term (engine/testing) to 2e-4 of the gains. Same bits on every instruction set.
float steer(const Surroundings& around, const Steered& self, const SteerParams& p);

/// v·n ≤ limit. Limits are not negative: an agent at rest breaks none.
struct Bound {
  Eigen::Vector2d n;  ///< unit vector to the other
  double limit_m_s;
};

/// Largest speed of an agent towards another: with h = gap/(2 headway) and m the mean of both
/// velocities along n, v·n ≤ h + clamp(m, ±h). The other has n and m with the opposite sign, so
/// together they close at most gap/headway: the gap never gets negative, in steps shorter than the
/// headway. An agent that follows another may go as fast as that one. Barrier functions of this
/// form are in [Ames et al., ECC 2019], halves of the velocity in RVO [van den Berg et al., ICRA
/// 2008].
inline double shared_limit(double gap_m, double headway_s, double mean_m_s) {
  const double h = gap_m > 0.0 ? gap_m / (2.0 * headway_s) : 0.0;
  const double m = mean_m_s < h ? mean_m_s : h;
  return h + (m > -h ? m : -h);
}

/// Two agents as one of them sees the other.
struct Pair {
  Eigen::Vector2d n;  ///< unit vector to the other
  double distance_m, gap_m;
  Eigen::Vector2d own_m_s, other_m_s;
};

/// The bound of two that would close faster than the gap allows, for a whole step: its line faces
/// the place where the other would be after the step, or who turn about each other within a step
/// would hold each other. At an angle θ to n, and with h' = h − distance (1 − cos θ)/(2 dt) ≥ 0 in
/// place of shared_limit's h, a place r of the other has |r·n'| ≥ radii + (1 − dt/headway) gap
/// before and after the step, and between. The other's bound has the opposite n'. Empty: they close
/// slowly.
std::optional<Bound> step_end_bound(const Pair& pair, double headway_s, double dt_s);

/// Limit where the other does not yield and goes at `other_m_s` along n. Below zero: step back.
inline double lone_limit(double gap_m, double headway_s, double other_m_s) {
  return (gap_m > 0.0 ? gap_m / headway_s : 0.0) + other_m_s;
}

/// The velocity within all bounds that is nearest to the wish; never faster than the wish.
/// A few times O(bounds).
Eigen::Vector2d nearest_within(const Eigen::Vector2d& wish_m_s, std::span<const Bound> bounds);

/// The tightest of all bounds, and below them a speed that keeps those that found no room.
class Bounds {
 public:
  static constexpr std::size_t kMost = 48;  // discs that are equal: no more than 6 touch one
  void add(const Bound& bound);
  /// Like `nearest_within`.
  Eigen::Vector2d nearest(const Eigen::Vector2d& wish_m_s) const;

 private:
  Bound bounds_[kMost];
  std::size_t count_ = 0;
  double speed_ = std::numeric_limits<double>::infinity();
};

/// Parts of `steer`, compiled for the instruction set of their caller.
namespace rows {

/// e^x of x ≤ 0, to 3e-6; 0 below -80.
MIMESIS_PART float exp_lane(float x) {
  constexpr float kMagic = 12582912.0F;  // 1.5·2²³; its low bits take n
  const float y = x > -80.0F ? x : -80.0F;
  const float n = (y * 1.44269504F + kMagic) - kMagic;
  const float r = (y - n * 0.693359375F) + n * 2.12194440e-4F, r2 = r * r;
  const float p =
      (1.0F + r) + r2 * ((0.5F + r * (1.0F / 6.0F)) + r2 * (1.0F / 24.0F + r * (1.0F / 120.0F)));
  const auto bits = (std::bit_cast<std::uint32_t>(n + kMagic) + 127U) << 23U;
  return p * std::bit_cast<float>(bits);
}

/// θ² of cos θ, θ in [0, π], to 7e-5 of θ [Abramowitz, Stegun, 4.4.45].
MIMESIS_PART float squared_angle(float cosine) {
  const float c = std::fabs(cosine);  // a selection would make two branches of all below
  const float rest = 1.0F - c;
  const float root = std::sqrt(rest > 0.0F ? rest : 0.0F);
  const float front =
      root * ((1.5707288F - 0.2121144F * c) + c * c * (0.0742610F - 0.0187293F * c));
  const float theta = cosine < 0.0F ? 3.14159265F - front : front;
  return theta * theta;
}

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
  // In stages, each over some lanes: one lane after the other would wait for its roots and
  // quotients.
  constexpr int kStage = 4 * kLanes;
  float sine[kStage], exponent[kStage], there_sine[kStage], there_exponent[kStage];
  for (int begin = 0; begin < around.count; begin += kStage) {
    const int end = around.count - begin < kStage ? around.count - begin : kStage;
    for (int k = 0; k < end; k += kLanes) {
      const float *ox = around.x + begin + k, *oy = around.y + begin + k;
      float *to_sine = sine + k, *to_exponent = exponent + k;
      for (int l = 0; l < kLanes; ++l) {
        const float rx = ox[l] - x, ry = oy[l] - y;
        const float d2 = rx * rx + ry * ry;
        const bool near = (d2 < reach2) & (d2 > 1e-12F);
        const float per_d = 1.0F / std::sqrt(d2 + 1e-20F);
        // sin(φ − φᵢⱼ) exp(−(φᵢⱼ − φ)²/2σ_φ²) exp(−d²/2σ_d²) [M18 eq. 3.26]
        to_sine[l] = near ? avoid_gain * ((hy * rx - hx * ry) * per_d) : 0.0F;
        to_exponent[l] =
            -(squared_angle((hx * rx + hy * ry) * per_d) * per_angle + d2 * per_distance);
      }
    }
    for (int k = 0; k < end; k += kLanes) {
      const float *ox = around.x + begin + k, *oy = around.y + begin + k;
      const float *ovx = around.vx + begin + k, *ovy = around.vy + begin + k;
      float *to_sine = there_sine + k, *to_exponent = there_exponent + k;
      for (int l = 0; l < kLanes; ++l) {
        const float rx = ox[l] - x, ry = oy[l] - y;
        const float d2 = rx * rx + ry * ry;
        const bool near = (d2 < reach2) & (d2 > 1e-12F);
        // avoidance at the closest approach of two agents that go straight on [M18 eq. 3.27]
        const float wx = ovx[l] - vx, wy = ovy[l] - vy;
        const float w2 = wx * wx + wy * wy, rw = rx * wx + ry * wy;
        const bool ahead = (w2 > 1e-12F) & (rw < 0.0F);
        const float time = -rw / (w2 + 1e-20F);
        const float cx = rx + time * wx, cy = ry + time * wy;          // closest
        const float qx = rx + time * ovx[l], qy = ry + time * ovy[l];  // where the other is then
        const float q2 = qx * qx + qy * qy;
        const bool here = q2 < 1e-12F;  // it comes to where the agent stands: as if straight ahead
        const float per_q = 1.0F / std::sqrt(q2 + 1e-20F);
        const float sine_then = here ? -sin_right : (hy * qx - hx * qy) * per_q;
        const float cosine_then = here ? cos_right : (hx * qx + hy * qy) * per_q;
        const float size = squared_angle(cosine_then) * per_angle +
                           (cx * cx + cy * cy) * per_distance + time * per_time;
        to_sine[l] = (near & ahead) ? predict_gain * sine_then : 0.0F;
        to_exponent[l] = (near & ahead) ? -size : 0.0F;  // in the past it may be too large
      }
    }
    for (int k = 0; k < end; k += kLanes) {
      for (int l = 0; l < kLanes; ++l) {
        sum[l] += sine[k + l] * exp_lane(exponent[k + l]) +
                  there_sine[k + l] * exp_lane(there_exponent[k + l]);
      }
    }
  }
  float total = 0.0F;
  for (int l = 0; l < kLanes / 2; ++l) sum[l] += sum[l + kLanes / 2];
  for (int l = 0; l < kLanes / 4; ++l) sum[l] += sum[l + kLanes / 4];
  total = (sum[0] + sum[2]) + (sum[1] + sum[3]);
  return total;
}

}  // namespace rows

}  // namespace mimesis::crowd
