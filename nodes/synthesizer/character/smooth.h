#pragma once
#include <algorithm>

#include "common/math/minimum_jerk.h"

namespace mimesis::synthesizer {

/// Quintics of u = t/T in [0, 1] for changes without jumps in value, rate and acceleration.
/// From 1 with rate and acceleration 0 to 0 (minimum jerk).
inline double fade_value(double u) { return 1.0 - math::minimum_jerk(u); }
/// From 0 with rate 1 per u to 0, rate 0, acceleration 0 at both ends.
inline double fade_rate(double u) { return u + u * u * u * (-6.0 + u * (8.0 - 3.0 * u)); }

/// Value at time t of an offset that had this value and rate [1/s] at t = 0 and fades within T
/// seconds. Used when one motion follows another: the difference between them fades.
inline double faded(double value, double rate_1_s, double t_s, double duration_s) {
  const double u = std::clamp(t_s / duration_s, 0.0, 1.0);
  return value * fade_value(u) + rate_1_s * duration_s * fade_rate(u);
}

/// Minimum-jerk course from 0 at `from` to 1 at `to`, constant outside.
inline double minimum_jerk(double t, double from, double to) {
  const double u = std::clamp((t - from) / (to - from), 0.0, 1.0);
  return math::minimum_jerk(u);
}

/// Cubic with value and slope at both ends of [0, duration], at t.
inline double hermite(double t, double duration, double x0, double v0, double x1, double v1) {
  const double u = t / duration, u2 = u * u, u3 = u2 * u;
  return (2.0 * u3 - 3.0 * u2 + 1.0) * x0 + (u3 - 2.0 * u2 + u) * duration * v0 +
         (3.0 * u2 - 2.0 * u3) * x1 + (u3 - u2) * duration * v1;
}

}  // namespace mimesis::synthesizer
