#include "nodes/synthesizer/character/parameters.h"

#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"

namespace mimesis::synthesizer {

MotionParameters parameters_of(const motion::Pattern& p) {
  const std::string name = "pattern '" + p.trial.style + "' of '" + p.trial.clip + "': ";
  if (p.mean_rad.size() == 0 || p.weight_rad.cols() == 0 ||
      p.weight_rad.rows() != p.mean_rad.size() || p.delay_rad.rows() != p.weight_rad.rows() ||
      p.delay_rad.cols() != p.weight_rad.cols()) {
    throw ConfigError(name + "means, weights and delays are of different sizes");
  }
  if (!p.mean_rad.allFinite() || !p.weight_rad.allFinite() || !p.delay_rad.allFinite()) {
    throw ConfigError(name + "a mean, weight or delay is not a finite number");
  }
  if (!(p.trial.duration_s > 0.0) || !std::isfinite(p.trial.duration_s)) {
    throw ConfigError(name + "the duration is " + std::to_string(p.trial.duration_s) +
                      " s, expected a positive one");
  }
  return {p.mean_rad, p.weight_rad, p.delay_rad, math::kTwoPi / p.trial.duration_s};
}

void blend(std::span<const MotionParameters> parts, std::span<const double> alpha,
           MotionParameters& out) {
  MIMESIS_ASSERT(!parts.empty() && parts.size() == alpha.size());
  double sum = 0.0;
  for (const double a : alpha) sum += a;
  MIMESIS_ASSERT(std::abs(sum - 1.0) < 1e-9);
  out.mean_rad = alpha[0] * parts[0].mean_rad;
  out.weight_rad = alpha[0] * parts[0].weight_rad;
  out.delay_rad = alpha[0] * parts[0].delay_rad;
  out.frequency_rad_s = alpha[0] * parts[0].frequency_rad_s;
  for (std::size_t p = 1; p < parts.size(); ++p) {
    out.mean_rad += alpha[p] * parts[p].mean_rad;
    out.weight_rad += alpha[p] * parts[p].weight_rad;
    out.delay_rad += alpha[p] * parts[p].delay_rad;
    out.frequency_rad_s += alpha[p] * parts[p].frequency_rad_s;
  }
}

double transition_weight(double phase_rad, double beta) {
  const double half_width = beta * std::numbers::pi;
  if (phase_rad <= -half_width) return 0.0;
  if (phase_rad >= half_width) return 1.0;
  return 0.5 * (1.0 + std::sin(phase_rad / (2.0 * beta)));
}

void transition(const MotionParameters& previous, const MotionParameters& next, int fixed,
                double phase_rad, double beta, MotionParameters& out) {
  const double a = transition_weight(phase_rad, beta), b = 1.0 - a;
  out.mean_rad = b * previous.mean_rad + a * next.mean_rad;
  out.weight_rad = b * previous.weight_rad + a * next.weight_rad;
  out.delay_rad = b * previous.delay_rad + a * next.delay_rad;
  out.frequency_rad_s = b * previous.frequency_rad_s + a * next.frequency_rad_s;
  const double sign = phase_rad < 0.0 ? -1.0 : 1.0;
  for (int k = 0; k < fixed; ++k) {
    out.weight_rad.col(k) = sign * (a * next.weight_rad.col(k) - b * previous.weight_rad.col(k));
  }
}

}  // namespace mimesis::synthesizer
