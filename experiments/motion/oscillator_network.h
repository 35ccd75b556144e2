#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "experiments/motion/adams_bashforth.h"
#include "experiments/motion/oscillators.h"

namespace mimesis::synthesizer {

enum class Integrator { rk4, adams_bashforth5 };

/// Oscillators of one kind with couplings, K(i, j) [1/s] of the influence of j on i:
///   ẋᵢ = f(xᵢ) + Σⱼ Kᵢⱼ pull(xᵢ, xⱼ) + αᵢ pull(xᵢ, yᵢ),
/// pull as the kind has it (velocity coupling [M18 eq. 3.13], diffusive [eq. 3.18]); yᵢ is an
/// external oscillator, for example of another character's leader. Any number up to 32, any graph.
/// @tparam Kind  VanDerPol or AndronovHopf
template <class Kind>
class OscillatorNetwork {
 public:
  static constexpr int kMost = 32;

  /// All start at phase 0 on their limit cycles.
  /// @param coupling_1_s  K, N×N, finite, zero diagonal, not negative
  /// @param dt_s          step; (row sum of K + α) dt must stay below the integrator's stability
  ///                      limit on the negative axis: 2.7 for RK4, 0.16 for Adams-Bashforth
  /// @throws ConfigError if one of these conditions fails (α: 0), or N is outside [1, 32].
  OscillatorNetwork(std::vector<Kind> oscillators, Eigen::MatrixXd coupling_1_s, double dt_s,
                    Integrator integrator = Integrator::rk4);

  int size() const { return static_cast<int>(kinds_.size()); }

  void set_state(int i, const Eigen::Vector2d& x);
  void set_phase(int i, double phase_rad);  ///< on the (circular) limit cycle
  void set_frequency(int i, double omega_rad_s);
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

  std::vector<Kind> kinds_;
  Eigen::MatrixXd coupling_;
  double dt_;
  Integrator integrator_;
  States x_, external_;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMost, 1> alpha_;
  math::AdamsBashforth5<States> adams_;
};

extern template class OscillatorNetwork<VanDerPol>;
extern template class OscillatorNetwork<AndronovHopf>;

/// All-to-all, K = k [M18 eq. 3.13].
Eigen::MatrixXd all_to_all(int n, double k_1_s);
/// Oscillator 0 leads, one-way to all others [M18 fig. 3.19].
Eigen::MatrixXd star(int n, double k_1_s);

}  // namespace mimesis::synthesizer
