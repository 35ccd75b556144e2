#pragma once
#include <algorithm>
#include <cmath>
#include <span>

#include "common/math/circle.h"
#include "nodes/crowd/rules/circular_sum.h"

namespace mimesis::crowd {

/// R̂ = √(1 − |Σ e^{iφ}|/N) [1], 0 in synchrony [M18 4.3.6]. Near synchrony it is σ_φ/√2; for that
/// 1 − |·| is computed as the mean of 2 sin²((φ − φ̂)/2), which keeps its digits.
inline double dispersion(std::span<const double> phi_rad) {
  if (phi_rad.empty()) return 0.0;
  const double mean = circular_sum(phi_rad).angle();
  double sum = 0.0;
  for (const double phi : phi_rad) {
    const double s = std::sin(0.5 * (phi - mean));
    sum += 2.0 * s * s;
  }
  return std::sqrt(sum / static_cast<double>(phi_rad.size()));
}

/// Largest distance of an angle from the circular mean [rad], [0, π].
inline double spread(std::span<const double> angles_rad) {
  const double mean = circular_sum(angles_rad).angle();
  double most = 0.0;
  for (const double a : angles_rad) most = std::max(most, std::abs(math::wrap_pi(a - mean)));
  return most;
}

/// Everybody within `tolerance_rad` of the circular mean; false if an angle is not finite. One
/// alone is in synchrony with itself.
inline bool in_synchrony(std::span<const double> angles_rad, double tolerance_rad) {
  return std::ranges::all_of(angles_rad, [](double a) { return std::isfinite(a); }) &&
         spread(angles_rad) <= tolerance_rad;
}

}  // namespace mimesis::crowd
