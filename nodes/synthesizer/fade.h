#pragma once
#include <algorithm>

#include "common/math/minimum_jerk.h"

namespace mimesis::synthesizer {

/// Quintics of u = t/T in [0, 1] for changes without jumps in value, rate and acceleration.
/// From 1 with rate and acceleration 0 to 0 (minimum jerk).
inline double fade_value(double u) { return 1.0 - math::minimum_jerk(u); }
/// From 0 with rate 1 per u to 0, rate 0, acceleration 0 at both ends.
inline double fade_rate(double u) { return u + u * u * u * (-6.0 + u * (8.0 - 3.0 * u)); }

/// What remains at time t of an offset that had this value and rate [1/s] at t = 0 and fades for
/// T seconds. So one motion follows another: the old one's difference to the new one fades.
inline double faded(double value, double rate_1_s, double t_s, double duration_s) {
  const double u = std::clamp(t_s / duration_s, 0.0, 1.0);
  return value * fade_value(u) + rate_1_s * duration_s * fade_rate(u);
}

}  // namespace mimesis::synthesizer
