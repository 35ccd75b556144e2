#pragma once
#include <Eigen/Core>

#include "common/dmp/andronov_hopf.h"
#include "nodes/crowd/graph/coupling_graph.h"

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
void hopf_network_rate(const CouplingGraph& graph, const dmp::AndronovHopf& oscillator,
                       double k_1_s, const HopfLeader& leader, const HopfStates& x,
                       Eigen::Ref<Eigen::Matrix2Xd> rate);

}  // namespace mimesis::crowd
