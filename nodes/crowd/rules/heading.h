#pragma once
#include <cmath>
#include <span>

#include "common/math/circle.h"
#include "nodes/crowd/graph/coupling_graph.h"
#include "nodes/crowd/rules/circular_sum.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {

// Rule IV and its relatives: ψ̇ of one agent [rad/s], ψ + to the left. Those of a goal of one's own
// and of avoidance are in common/dmp/navigation.h.

/// ψ_goal of the sliding goal on the agent's line [M18 eq. 4.32, fig. 4.9b].
/// @param psi_path_rad  direction of the path
/// @param off_lane_m    ξ minus the lane, + to the left of the line
/// @param ahead_m       Δz > 0
inline double sliding_goal(double psi_path_rad, double off_lane_m, double ahead_m) {
  return psi_path_rad - std::atan2(off_lane_m, ahead_m);
}

/// φ̇ (m_ψ sin(ψ_goal − ψ) + g^ψ(φ)) [M18 eq. 4.32], and with ψ_goal = χ that of consensus
/// [eq. 4.33].
/// @param sway  g^ψ(φ), swaying of the heading over the gait cycle [1]
inline double lane_rate(const HeadingRule& rule, double phi_rate_rad_s, double psi_rad,
                        double psi_goal_rad, double sway = 0.0) {
  return phi_rate_rad_s * (rule.gain * std::sin(psi_goal_rad - psi_rad) + sway);
}

/// χ̇ of the consensus variable behind its low-pass, τ χ̇ = arg Σ e^{iψ} − χ on the circle
/// [M18 4.4.2].
/// @param mean_rad  arg Σ e^{iψ};  rule.low_pass_s > 0
inline double consensus_rate(const HeadingRule& rule, double chi_rad, double mean_rad) {
  return math::wrap_pi(mean_rad - chi_rad) / rule.low_pass_s;
}

/// k sin(Δψ) exp(−Δψ²/2σ²), Δψ = ψⱼ − ψᵢ wrapped; σ = 0: without the Gaussian [M18 eq. 4.41].
inline double heading_pull(double k_1_s, double sigma_rad, double psi_i_rad, double psi_j_rad) {
  const double off = math::wrap_pi(psi_j_rad - psi_i_rad);
  const double pull = k_1_s * std::sin(off);
  return sigma_rad > 0.0 ? pull * std::exp(-0.5 * off * off / (sigma_rad * sigma_rad)) : pull;
}

/// rate[i] += Σⱼ Aᵢⱼ heading_pull(ψᵢ, ψⱼ) with k = rule.gain, σ = rule.spread_rad [M18
/// eq. 4.41, 4.45: A, for with the Laplacian's signs it would repel]. Contracts while all are
/// within π/2 of each other, at kλ⁺ in the end. O(N + edges); all-to-all by the mean field O(N) for
/// σ = 0, else O(N²). Does not allocate.
void add_heading_coupling(const CouplingGraph& graph, const HeadingRule& rule,
                          std::span<const double> psi_rad, std::span<double> rate_rad_s);

/// k Σⱼ sin(ψⱼ − ψ) from the sums over all agents.
inline double mean_field_heading(const CircularSum& sum, double k_1_s, double psi_rad) {
  return k_1_s * (sum.sin * std::cos(psi_rad) - sum.cos * std::sin(psi_rad));
}

}  // namespace mimesis::crowd
