#pragma once
#include <cmath>
#include <span>

namespace mimesis::crowd {

/// Mean field of angles on the circle: Σ cos, Σ sin and how many. Sums of parts of a crowd add up.
struct CircularSum {
  double cos = 0.0, sin = 0.0;
  double count = 0.0;

  void add(double angle_rad) {
    cos += std::cos(angle_rad);
    sin += std::sin(angle_rad);
    count += 1.0;
  }
  CircularSum& operator+=(const CircularSum& other) {
    cos += other.cos;
    sin += other.sin;
    count += other.count;
    return *this;
  }
  /// arg Σ e^{iφ} in [-π, π] rad; of nothing 0.
  double angle() const { return std::atan2(sin, cos); }
  /// |Σ e^{iφ}| / N in [0, 1], 1 in synchrony; of nothing 0.
  double order() const { return count > 0.0 ? std::hypot(cos, sin) / count : 0.0; }
};

/// Sums in the order given.
inline CircularSum circular_sum(std::span<const double> angles_rad) {
  CircularSum sum;
  for (const double a : angles_rad) sum.add(a);
  return sum;
}

}  // namespace mimesis::crowd
