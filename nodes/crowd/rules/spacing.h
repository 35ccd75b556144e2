#pragma once
#include <algorithm>
#include <cmath>
#include <span>

#include "nodes/crowd/graph/coupling_graph.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {

// Rules I and II act on how far an agent is ahead of its place among the others. With dᵢ the place
// of agent i along the path and xᵢ = zᵢ − dᵢ, the error is e = L x, zero in formation.

/// eᵢ = Σⱼ Aᵢⱼ (zᵢ − zⱼ − dᵢ + dⱼ) [m]. All spans have graph.size() elements. O(N + edges),
/// all-to-all by the mean; does not allocate.
void spacing_errors(const CouplingGraph& graph, std::span<const double> z_m,
                    std::span<const double> d_m, std::span<double> error_m);

/// The same of one agent of an all-to-all group of n, from Σ (z − d) over all of them.
inline double mean_field_error(double z_m, double d_m, double sum_m, double n) {
  return n * (z_m - d_m) - sum_m;
}

/// limit · tanh(e / limit): odd, slope 1 at zero, within ±limit; the logistic function of [M10],
/// centred so that the sum of the corrections is zero in formation. Limit 0: e itself.
inline double saturate(double e, double limit) {
  return limit > 0.0 ? limit * std::tanh(e / limit) : e;
}

/// I: what is added to φ̇ [rad/s]: −m_d sat(e) [M18 eq. 4.28]. With a low-pass in the rule `error_m`
/// is its state ε.
inline double frequency_change(const FrequencyRule& rule, double error_m) {
  return -rule.gain_rad_m_s * saturate(error_m, rule.saturation_m);
}

/// ε̇ = α (e − ε) of the low-pass of rule I; [m/s]. [M10] filters with gain 1/α: its m is our m_d α,
/// its bound α > √(m g_max λ_max) is α > m_d g_max λ_max.
inline double low_pass_rate(const FrequencyRule& rule, double filtered_m, double error_m) {
  return rule.low_pass_rad_s * (error_m - filtered_m);
}

/// II: μ = −m_z e, within ±limit, where length scales speed linearly [M18 eq. 4.30, M10].
inline double step_length_change(const LengthRule& rule, double error_m) {
  return std::clamp(-rule.gain_1_m * error_m, -rule.limit, rule.limit);
}

/// How far the group is from its formation: max − min of z − d [m], which is the largest error of a
/// distance of two; without agents 0.
double formation_error(std::span<const double> z_m, std::span<const double> d_m);

}  // namespace mimesis::crowd
