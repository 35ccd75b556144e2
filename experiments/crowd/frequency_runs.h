#pragma once
#include <Eigen/Core>
#include <vector>

#include "nodes/crowd/rules/gait.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {

/// ⟨g⟩ of their gaits.
inline constexpr double kMean_m_rad = 0.2;

/// Agents behind each other that keep their distances by the frequency of their steps alone
/// [M18 eq. 4.28, 4.29; M10 with a low-pass], one column each of φ, z and ε.
struct FrequencyRun {
  CouplingGraph graph;
  FrequencyRule rule;
  SpeedFunction gait;
  double omega_rad_s = 6.0;
  std::vector<double> place_m;  ///< dᵢ

  using State = Eigen::Array<double, Eigen::Dynamic, 3>;

  /// zᵢ = G(φᵢ) + dᵢ: phases decide about places, as eq. 4.29 has it with cᵢ = dᵢ. Formation is
  /// then synchrony.
  State tied(const std::vector<double>& phi_rad) const;
  void step(State& x, double dt_s) const;  ///< RK4
  double error_m(const State& x) const;    ///< max − min of z − d
  /// max − min of φ. For tied agents it decays like the error, without the swing of g in front.
  static double phase_error_rad(const State& x) {
    return x.col(0).maxCoeff() - x.col(0).minCoeff();
  }
};

/// g with one harmonic of two steps a cycle: ⟨g⟩ (1 + a cos 2φ).
SpeedFunction gait_of(double mean_m_rad, double amplitude);

}  // namespace mimesis::crowd
