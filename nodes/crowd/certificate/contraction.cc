#include "nodes/crowd/certificate/contraction.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "nodes/crowd/certificate/spectrum.h"

namespace mimesis::crowd {
namespace {

constexpr int kMostAgents = 1 << 24;  // of a search; a graph of more is none of one crowd

bool meets(Condition condition, double alpha, double beta) {
  return condition == Condition::weak ? weak_condition(alpha, beta)
                                      : theorem6_sum(alpha, beta) < 1.0;
}

bool between(double ratio, double other) {
  const double root = (1.0 - ratio) / (1.0 + 3.0 * ratio);
  return other > root * root;
}

}  // namespace

double theorem6_sum(double alpha, double beta) {
  const double zeta = half_range(alpha), eta = half_range(beta);
  return zeta * zeta + eta * eta;
}

bool weak_condition(double alpha, double beta) { return beta > half_range(alpha); }

bool stronger_condition(double alpha, double beta) {
  return between(alpha, beta) || between(beta, alpha);
}

double least_anticommutator(double a_least, double a_most, double b_least, double b_most) {
  const double centre = 0.25 * (a_least + a_most) * (b_least + b_most);
  const double zeta = half_range(a_least / a_most), eta = half_range(b_least / b_most);
  if (zeta + eta <= 1.0) return centre * (1.0 - zeta) * (1.0 - eta);
  return 0.5 * centre * (1.0 - zeta * zeta - eta * eta);
}

std::optional<int> largest_agents(Topology topology, double beta, Condition condition) {
  const int first = topology == Topology::wheel ? 4 : 2;
  const auto good = [&](int n) { return meets(condition, extremes(topology, n).ratio(), beta); };
  MIMESIS_ASSERT(beta > 0.0 && good(first));
  // α falls as N grows: doubling, then bisection.
  int low = first, high = first;
  while (good(high)) {
    if (high >= kMostAgents) return std::nullopt;
    low = high;
    high *= 2;
  }
  while (high - low > 1) {
    const int middle = low + (high - low) / 2;
    (good(middle) ? low : high) = middle;
  }
  return low;
}

double least_gait_ratio(double alpha) {
  const double zeta = half_range(alpha);
  const double eta = std::sqrt(std::max(0.0, 1.0 - zeta * zeta));
  return half_range(eta);
}

double low_pass_rate(double m, double low_pass_rad_s, double g_least, double g_most,
                     double lambda_least, double lambda_most) {
  return std::min(m * g_least * lambda_least, low_pass_rad_s - m * g_most * lambda_most);
}

double low_pass_mode_rate(double low_pass_rad_s, double slope_1_s) {
  const double inside = 1.0 - 4.0 * slope_1_s / low_pass_rad_s;
  return 0.5 * low_pass_rad_s * (1.0 - std::sqrt(std::max(0.0, inside)));
}

}  // namespace mimesis::crowd
