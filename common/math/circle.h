#pragma once
#include <cmath>
#include <numbers>

namespace mimesis::math {

inline constexpr double kTwoPi = 2.0 * std::numbers::pi;

/// Wraps an angle to [-π, π] rad.
inline double wrap_pi(double angle_rad) { return std::remainder(angle_rad, kTwoPi); }

/// Wraps an angle to [0, 2π) rad.
inline double wrap_two_pi(double angle_rad) {
  const double wrapped = angle_rad - kTwoPi * std::floor(angle_rad / kTwoPi);
  return wrapped < kTwoPi ? wrapped : 0.0;  // just below zero rounds up to 2π
}

}  // namespace mimesis::math
