#pragma once
#include <Eigen/Core>

#include "experiments/dmp/andronov_hopf.h"
#include "nodes/crowd/rules/coupling_graph.h"

// Oscillators of [M18 4.3, 4.5]. The crowd's agents have phases alone; figures compare.
namespace mimesis::crowd {

/// States of a network of oscillators, one column each.
using HopfStates = Eigen::Ref<const Eigen::Matrix2Xd>;

/// One-way coupling of all to the oscillator in state x₀ [M18 eq. 4.26].
struct HopfLeader {
  double gain_1_s = 0.0;  ///< α, 0: none
  Eigen::Vector2d x = Eigen::Vector2d::Zero();
};

/// ẋᵢ = f(xᵢ) + k Σⱼ Aᵢⱼ (xⱼ − xᵢ) + α (x₀ − xᵢ), f that of an Andronov-Hopf oscillator [M18 eq.
/// 4.24, 4.26]. Contracts to synchrony from every start if kλ⁺ > 1 (sufficient), to the leader if
/// α > 1; its rates near synchrony on the limit cycle are kλ⁺ (+ α with a leader), and α to the
/// leader. All 2×graph.size(). O(N + edges), all-to-all by the mean; does not allocate.
inline void hopf_network_rate(const CouplingGraph& graph, const dmp::AndronovHopf& oscillator,
                              double k_1_s, const HopfLeader& leader, const HopfStates& x,
                              Eigen::Ref<Eigen::Matrix2Xd> rate) {
  const auto n = static_cast<double>(x.cols());
  const Eigen::Vector2d sum = x.rowwise().sum();
  for (int i = 0; i < x.cols(); ++i) {
    const Eigen::Vector2d own = x.col(i);
    Eigen::Vector2d pull = Eigen::Vector2d::Zero();
    if (graph.complete()) pull = sum - n * own;
    for (const auto& other : graph.neighbours(i)) {
      pull += other.weight * dmp::AndronovHopf::pull(own, x.col(other.index));
    }
    rate.col(i) = oscillator.rate(own) + k_1_s * pull +
                  leader.gain_1_s * dmp::AndronovHopf::pull(own, leader.x);
  }
}

/// Shape of a limit cycle and how fast strays come back to it, at one phase.
struct WarpedCycle {
  double rho = 1.0;       ///< F(φ) = 1/r₀²(φ) of the cycle's radius r₀, > 0
  double slope = 0.0;     ///< dF/dφ [1/rad]
  double gain_1_s = 2.0;  ///< α(φ) > 0, 2 of the plain oscillator
};

/// ρ̇ of an Andronov-Hopf oscillator in inverted squared radius ρ = 1/r², warped to another cycle:
/// ρ̇ = α(φ) (F(φ) − ρ) + φ̇ dF/dφ [M18 eq. 4.48, 4.49, 4.51; 4.48 is dρ/dφ, where its ω belongs to
/// the first term]. Then ρ − F decays as exp(−∫α dt), for any φ: the phases may be coupled by rule
/// III and the whole contracts if they do.
inline double warped_rate(const WarpedCycle& cycle, double phi_rate_rad_s, double rho) {
  return cycle.gain_1_s * (cycle.rho - rho) + phi_rate_rad_s * cycle.slope;
}

}  // namespace mimesis::crowd
