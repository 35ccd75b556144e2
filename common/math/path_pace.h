#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace mimesis::math {

/// How fast the pace along a path may change [1/s].
struct PaceRates {
  double lowest, highest;
};

/// A path q(σ) is driven at the pace σ̇, so that q̈ = q' σ̈ + q'' σ̇². Returns the σ̈ that keep every
/// joint within |q̈ⱼ| ≤ aⱼ. Braking at 1/s and keeping the pace are always allowed: a path that asks
/// for more than a is left to the guard behind.
/// @param dq, ddq  q', q'' [rad/s], [rad/s²] if σ is the planned time
template <class A, class B, class C>
PaceRates pace_rates(const Eigen::MatrixBase<A>& dq, const Eigen::MatrixBase<B>& ddq, double pace,
                     const Eigen::MatrixBase<C>& a_max) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  PaceRates rates{-kInfinity, kInfinity};
  for (Eigen::Index j = 0; j < dq.size(); ++j) {
    const double speed = std::abs(dq[j]), drift = std::copysign(ddq[j], ddq[j] * dq[j]);
    if (speed < 1e-9) continue;
    rates.lowest = std::max(rates.lowest, (-a_max[j] - drift * pace * pace) / speed);
    rates.highest = std::min(rates.highest, (a_max[j] - drift * pace * pace) / speed);
  }
  return {std::min(rates.lowest, -1.0), std::max(rates.highest, 0.0)};
}

}  // namespace mimesis::math
