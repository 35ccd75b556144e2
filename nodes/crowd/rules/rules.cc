#include "nodes/crowd/rules/rules.h"

#include <algorithm>

#include "common/math/circle.h"

namespace mimesis::crowd {

CircularSum circular_sum(std::span<const double> angles_rad) {
  CircularSum sum;
  for (const double a : angles_rad) sum.add(a);
  return sum;
}

double dispersion(std::span<const double> phi_rad) {
  if (phi_rad.empty()) return 0.0;
  const double mean = circular_sum(phi_rad).angle();
  double sum = 0.0;
  for (const double phi : phi_rad) {
    const double s = std::sin(0.5 * (phi - mean));
    sum += 2.0 * s * s;
  }
  return std::sqrt(sum / static_cast<double>(phi_rad.size()));
}

double spread(std::span<const double> angles_rad) {
  const double mean = circular_sum(angles_rad).angle();
  double most = 0.0;
  for (const double a : angles_rad) most = std::max(most, std::abs(math::wrap_pi(a - mean)));
  return most;
}

void spacing_errors(const CouplingGraph& graph, std::span<const double> z_m,
                    std::span<const double> d_m, std::span<double> error_m) {
  const std::size_t n = z_m.size();
  if (graph.complete()) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) sum += z_m[i] - d_m[i];
    for (std::size_t i = 0; i < n; ++i) {
      error_m[i] = mean_field_error(z_m[i] - d_m[i], sum, static_cast<double>(n));
    }
    return;
  }
  for (std::size_t i = 0; i < n; ++i) {
    double sum = 0.0;
    for (const auto& other : graph.neighbours(static_cast<int>(i))) {
      const auto j = static_cast<std::size_t>(other.index);
      sum += other.weight * (z_m[i] - z_m[j] - d_m[i] + d_m[j]);
    }
    error_m[i] = sum;
  }
}

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

double nearest_turn(double phi_rad, double reference_rad) {
  return reference_rad + math::wrap_pi(phi_rad - reference_rad);
}

void lift_phases(std::span<double> phi_rad) {
  const double mean = circular_sum(phi_rad).angle();
  for (double& phi : phi_rad) phi = nearest_turn(phi, mean);
}

void add_heading_coupling(const CouplingGraph& graph, const HeadingRule& rule,
                          std::span<const double> psi_rad, std::span<double> rate_rad_s) {
  const std::size_t n = psi_rad.size();
  const double sigma = rule.spread_rad;
  const auto pull = [&](std::size_t i, std::size_t j) {
    const double off = math::wrap_pi(psi_rad[j] - psi_rad[i]);
    const double plain = rule.gain * std::sin(off);
    return sigma > 0.0 ? plain * std::exp(-0.5 * off * off / (sigma * sigma)) : plain;
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
