#pragma once
#include <Eigen/Core>
#include <cmath>

#include "common/math/circle.h"

namespace mimesis::dmp {

/// Andronov-Hopf oscillator [M18 eq. 3.16, 4.14]; its limit cycle is the unit circle, attracting as
/// r(t) = (1 + (1/r₀² − 1) e^{−2t})^{−1/2}, its phase runs at ω for every r.
struct AndronovHopf {
  double omega_rad_s = 6.0;  ///< ω

  Eigen::Vector2d rate(const Eigen::Vector2d& x) const {
    const double grow = 1.0 - x.squaredNorm();
    return {grow * x[0] - omega_rad_s * x[1], grow * x[1] + omega_rad_s * x[0]};
  }
  static Eigen::Vector2d to_circle(const Eigen::Vector2d& x) { return x; }
  static Eigen::Vector2d from_circle(const Eigen::Vector2d& u) { return u; }
  /// Diffusive coupling [M18 eq. 3.18].
  static Eigen::Vector2d pull(const Eigen::Vector2d& x, const Eigen::Vector2d& y) { return y - x; }
};

/// The phase that belongs to a point u of the (scaled) phase plane, [0, 2π).
inline double phase_of(const Eigen::Vector2d& u) {
  const double phase = std::atan2(u[1], u[0]);
  return phase < 0.0 ? phase + math::kTwoPi : phase;
}

}  // namespace mimesis::dmp
