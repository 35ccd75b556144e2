#include "nodes/crowd/rules/heading.h"

namespace mimesis::crowd {

void add_heading_coupling(const CouplingGraph& graph, const HeadingRule& rule,
                          std::span<const double> psi_rad, std::span<double> rate_rad_s) {
  const std::size_t n = psi_rad.size();
  if (graph.complete() && rule.spread_rad == 0.0) {
    const CircularSum sum = circular_sum(psi_rad);
    for (std::size_t i = 0; i < n; ++i) {
      rate_rad_s[i] += mean_field_heading(sum, rule.gain, psi_rad[i]);
    }
    return;
  }
  const auto pull = [&](std::size_t i, std::size_t j) {
    return heading_pull(rule.gain, rule.spread_rad, psi_rad[i], psi_rad[j]);
  };
  for (std::size_t i = 0; i < n; ++i) {
    double sum = 0.0;
    if (graph.complete()) {
      for (std::size_t j = 0; j < n; ++j) sum += pull(i, j);
    } else {
      for (const auto& other : graph.neighbours(static_cast<int>(i))) {
        sum += other.weight * pull(i, static_cast<std::size_t>(other.index));
      }
    }
    rate_rad_s[i] += sum;
  }
}

}  // namespace mimesis::crowd
