#pragma once
#include <Eigen/Core>
#include <cmath>

#include "common/dmp/andronov_hopf.h"

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

/// s₀ = cos(φ/2), φ in [0, 2π): the non-periodic source, locked to a leading oscillator
/// [M18 fig. 3.19].
inline double locked_source(double phase_rad) { return std::cos(0.5 * phase_rad); }

/// Point attractor ẋ = u x (1 − x) on [0, 1] [M18 eq. 3.12]: for u > 0 it goes to 1, for u < 0 to
/// 0, with bell-shaped velocity: x(t) = (1 + tanh(u(t − t₀)/2))/2. Switching adds a short pulse
/// that takes x off the fixed point that has become unstable, so that the timing is defined.
class PointAttractor {
 public:
  /// @param speed_1_s  |u| > 0;  @param pulse_1_s  height of the pulse > 0, added to ẋ
  /// @param pulse_s    its duration > 0
  /// @throws ConfigError if one of them is not positive and finite.
  PointAttractor(double speed_1_s, double pulse_1_s, double pulse_s, double dt_s);

  /// From now on to 1 (true) or 0. Starts a pulse in that direction if it is a change.
  void switch_to(bool one);
  /// RK4; the pulse acts for a whole number of steps, at least one. The result is clipped to [0,
  /// 1].
  void step();

  double value() const { return x_; }
  void set_value(double x) { x_ = x < 0.0 ? 0.0 : (x > 1.0 ? 1.0 : x); }

 private:
  double speed_, pulse_, dt_, x_ = 0.0;
  int pulse_steps_, left_ = 0;
  bool one_ = false;
};

}  // namespace mimesis::synthesizer
