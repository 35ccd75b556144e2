#pragma once
#include <Eigen/Core>
#include <cmath>

#include "experiments/dmp/andronov_hopf.h"

namespace mimesis::synthesizer {

using dmp::AndronovHopf;

/// Van der Pol oscillator [M18 eq. 3.11]: ẍ + ν (x² − ρ) ẋ + ω₀² x = input. State (x, ẋ). For
/// small νρ/ω₀ its limit cycle has amplitude 2√ρ and frequency ω₀ (1 − (νρ/ω₀)²/16).
struct VanDerPol {
  double nu = 1.0;           ///< ν > 0 [1/s]
  double rho = 0.25;         ///< ρ > 0; 0.25 gives amplitude 1
  double omega_rad_s = 6.0;  ///< ω₀ > 0

  Eigen::Vector2d rate(const Eigen::Vector2d& x) const {
    return {x[1], -nu * (x[0] * x[0] - rho) * x[1] - omega_rad_s * omega_rad_s * x[0]};
  }
  /// Θx: the limit cycle becomes nearly the unit circle, run through counterclockwise [eq. 3.15].
  /// (Hence the minus: ẋ of a cosine is a negative sine.)
  Eigen::Vector2d to_circle(const Eigen::Vector2d& x) const {
    const double a = 2.0 * std::sqrt(rho);
    return {x[0] / a, -x[1] / (a * omega_rad_s)};
  }
  Eigen::Vector2d from_circle(const Eigen::Vector2d& u) const {
    const double a = 2.0 * std::sqrt(rho);
    return {a * u[0], -a * omega_rad_s * u[1]};
  }
  /// Velocity coupling to an oscillator in state y [eq. 3.13]: acts on ẍ.
  static Eigen::Vector2d pull(const Eigen::Vector2d& x, const Eigen::Vector2d& y) {
    return {0.0, y[1] - x[1]};
  }
};

}  // namespace mimesis::synthesizer
