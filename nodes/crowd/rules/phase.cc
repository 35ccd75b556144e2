#include "nodes/crowd/rules/phase.h"

#include <cmath>

namespace mimesis::crowd {

PhasePull mean_field_pull(const CircularSum& sum, double k_1_s, const Leader& leader) {
  const double c = k_1_s * sum.cos + leader.gain_1_s * std::cos(leader.phi_rad);
  const double s = k_1_s * sum.sin + leader.gain_1_s * std::sin(leader.phi_rad);
  return {std::atan2(s, c), k_1_s * sum.count + leader.gain_1_s};
}

void add_phase_coupling(const CouplingGraph& graph, double k_1_s, std::span<const double> phi_rad,
                        const Leader& leader, std::span<double> rate_rad_s) {
  if (graph.complete()) {
    const PhasePull pull = mean_field_pull(circular_sum(phi_rad), k_1_s, leader);
    for (std::size_t i = 0; i < phi_rad.size(); ++i) rate_rad_s[i] += pull.rate(phi_rad[i]);
    return;
  }
  for (int i = 0; i < graph.size(); ++i) {
    const double phi = phi_rad[static_cast<std::size_t>(i)];
    double sum = 0.0;
    for (const auto& other : graph.neighbours(i)) {
      sum += other.weight * (phi_rad[static_cast<std::size_t>(other.index)] - phi);
    }
    rate_rad_s[static_cast<std::size_t>(i)] +=
        k_1_s * sum + leader.gain_1_s * (leader.phi_rad - phi);
  }
}

void lift_phases(std::span<double> phi_rad) {
  const double mean = circular_sum(phi_rad).angle();
  for (double& phi : phi_rad) phi = nearest_turn(phi, mean);
}

}  // namespace mimesis::crowd
