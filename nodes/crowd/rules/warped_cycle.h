#pragma once
#include <cmath>

namespace mimesis::crowd {

/// Shape of a limit cycle and how fast strays come back to it, at one phase.
struct WarpedCycle {
  double rho = 1.0;       ///< F(φ) = 1/r₀²(φ) of the cycle's radius r₀, > 0
  double slope = 0.0;     ///< dF/dφ [1/rad]
  double gain_1_s = 2.0;  ///< α(φ) > 0, 2 of the plain oscillator
};

/// ρ̇ of an Andronov-Hopf oscillator in inverted squared radius ρ = 1/r², warped to another cycle:
/// ρ̇ = α(φ) (F(φ) − ρ) + φ̇ dF/dφ [M18 eq. 4.48, 4.49, 4.51; 4.48 is dρ/dφ, where its ω belongs to
/// the first term]. Then ρ − F decays as exp(−∫α dt), whatever φ does: the phases may be coupled by
/// rule III and the whole contracts if they do.
inline double warped_rate(const WarpedCycle& cycle, double phi_rate_rad_s, double rho) {
  return cycle.gain_1_s * (cycle.rho - rho) + phi_rate_rad_s * cycle.slope;
}

/// ṙ of the plain oscillator, r (1 − r²) [M18 eq. 4.16]; its phase runs at ω plus rule III.
inline double radius_rate(double r) { return r * (1.0 - r * r); }

}  // namespace mimesis::crowd
