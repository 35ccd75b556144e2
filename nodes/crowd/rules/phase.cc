#include "nodes/crowd/rules/phase.h"

#include <cmath>
#include <utility>
#include <vector>

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

void lift_phases(const CouplingGraph& graph, std::span<double> phi_rad) {
  if (graph.complete()) {
    const double mean = circular_sum(phi_rad).angle();
    for (double& phi : phi_rad) phi = nearest_turn(phi, mean);
    return;
  }
  std::vector<char> lifted(phi_rad.size(), 0);
  std::vector<int> open;  // breadth first: lifts run along shortest ways
  for (int root = 0; root < graph.size(); ++root) {
    if (std::exchange(lifted[static_cast<std::size_t>(root)], 1)) continue;
    open.assign(1, root);
    for (std::size_t next = 0; next < open.size(); ++next) {
      const int i = open[next];
      for (const auto& other : graph.neighbours(i)) {
        const auto j = static_cast<std::size_t>(other.index);
        if (std::exchange(lifted[j], 1)) continue;
        phi_rad[j] = nearest_turn(phi_rad[j], phi_rad[static_cast<std::size_t>(i)]);
        open.push_back(other.index);
      }
    }
  }
}

}  // namespace mimesis::crowd
