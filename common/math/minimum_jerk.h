#pragma once

namespace mimesis::math {

/// Minimum jerk [Flash, Hogan 1985]: 10u³ − 15u⁴ + 6u⁵, from 0 to 1 while u goes from 0 to 1, with
/// speed and acceleration 0 at both ends. Precondition: u ∈ [0, 1].
inline double minimum_jerk(double u) { return u * u * u * (10.0 + u * (6.0 * u - 15.0)); }
/// Its slope by u: at most 15/8, in the middle.
inline double minimum_jerk_rate(double u) { return 30.0 * u * u * (1.0 - u) * (1.0 - u); }
inline constexpr double kMinimumJerkPeak = 1.875;

}  // namespace mimesis::math
