#include "nodes/crowd/rules/spacing.h"

namespace mimesis::crowd {

void spacing_errors(const CouplingGraph& graph, std::span<const double> z_m,
                    std::span<const double> d_m, std::span<double> error_m) {
  const std::size_t n = z_m.size();
  if (graph.complete()) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) sum += z_m[i] - d_m[i];
    for (std::size_t i = 0; i < n; ++i) {
      error_m[i] = mean_field_error(z_m[i], d_m[i], sum, static_cast<double>(n));
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

double formation_error(std::span<const double> z_m, std::span<const double> d_m) {
  if (z_m.empty()) return 0.0;
  double least = z_m[0] - d_m[0], most = least;
  for (std::size_t i = 1; i < z_m.size(); ++i) {
    least = std::min(least, z_m[i] - d_m[i]);
    most = std::max(most, z_m[i] - d_m[i]);
  }
  return most - least;
}

}  // namespace mimesis::crowd
