#pragma once
#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "experiments/dmp/andronov_hopf.h"

namespace mimesis::synthesizer {

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

/// Van der Pol oscillators with couplings, K(i, j) [1/s] of the influence of j on i [M18 eq. 3.13]:
///   ẋᵢ = f(xᵢ) + Σⱼ Kᵢⱼ pull(xᵢ, xⱼ) + αᵢ pull(xᵢ, yᵢ);
/// yᵢ is an external oscillator, for example of another character's leader. Any number up to 32,
/// any graph.
class OscillatorNetwork {
 public:
  static constexpr int kMost = 32;

  /// All start at phase 0 on their limit cycles.
  /// @param coupling_1_s  K, N×N, finite, zero diagonal, not negative
  /// @param dt_s          step; (row sum of K + α) dt must stay below RK4's stability limit on the
  ///                      negative axis, 2.7
  /// @throws ConfigError if one of these conditions fails (α: 0), or N is outside [1, 32].
  OscillatorNetwork(std::vector<VanDerPol> oscillators, Eigen::MatrixXd coupling_1_s, double dt_s);

  int size() const { return static_cast<int>(kinds_.size()); }

  void set_state(int i, const Eigen::Vector2d& x);
  void set_phase(int i, double phase_rad);  ///< on the (circular) limit cycle
  /// Couples i to an external state y with strength α [1/s], held until changed; 0: none.
  void set_external(int i, const Eigen::Vector2d& y, double alpha_1_s);

  void step();  ///< by dt; does not allocate

  Eigen::Vector2d state(int i) const { return x_.col(i); }
  /// Θxᵢ, near the unit circle.
  Eigen::Vector2d circle(int i) const { return kinds_[std::size_t(i)].to_circle(x_.col(i)); }
  double phase(int i) const { return dmp::phase_of(circle(i)); }  ///< [0, 2π)

 private:
  using States = Eigen::Matrix<double, 2, Eigen::Dynamic, 0, 2, kMost>;
  States rate(const States& x) const;

  std::vector<VanDerPol> kinds_;
  Eigen::MatrixXd coupling_;
  double dt_;
  States x_, external_;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1> alpha_;
};

/// All-to-all, K = k [M18 eq. 3.13].
Eigen::MatrixXd all_to_all(int n, double k_1_s);

}  // namespace mimesis::synthesizer
