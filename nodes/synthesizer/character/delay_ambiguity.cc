#include "nodes/synthesizer/character/delay_ambiguity.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

/// Power of the harmonics 1.. of a period, of sum one.
Eigen::VectorXd harmonic_power(const Eigen::Ref<const Eigen::RowVectorXd>& source) {
  const Eigen::Index length = source.size(), count = (length - 1) / 2;
  Eigen::VectorXd power(count);
  for (Eigen::Index f = 1; f <= count; ++f) {
    double c = 0.0, s = 0.0;
    for (Eigen::Index t = 0; t < length; ++t) {
      const double angle =
          math::kTwoPi * static_cast<double>(f * t % length) / static_cast<double>(length);
      c += source[t] * std::cos(angle);
      s += source[t] * std::sin(angle);
    }
    power[f - 1] = c * c + s * s;
  }
  const double sum = power.sum();
  return sum > 0.0 ? Eigen::VectorXd(power / sum) : power;
}

struct Correlation {
  double value, slope, curvature;
};

/// ρ(δ) = Σ P_f cos fδ and its derivatives.
Correlation autocorrelation(const Eigen::VectorXd& power, double shift_rad) {
  Correlation r{0.0, 0.0, 0.0};
  for (Eigen::Index i = 0; i < power.size(); ++i) {
    const double f = static_cast<double>(i + 1);
    const double c = std::cos(f * shift_rad), s = std::sin(f * shift_rad);
    r.value += power[i] * c;
    r.slope -= power[i] * f * s;
    r.curvature -= power[i] * f * f * c;
  }
  return r;
}

/// An equivalent of one (weight, delay).
struct Choice {
  double delay_rad, weight_rad, similarity;
};

/// The equivalent with the delay nearest to `target`, whole turns included.
Choice nearest_choice(const std::vector<SelfSimilarity>& same, double delay, double weight,
                      double target) {
  Choice best{delay, weight, 1.0};
  double best_distance = std::numeric_limits<double>::infinity();
  for (const SelfSimilarity& e : same) {
    const double away = math::wrap_pi(delay - e.shift_rad - target);
    if (std::abs(away) < best_distance - 1e-9) {
      best_distance = std::abs(away);
      best = {target + away, weight * e.similarity, e.similarity};
    }
  }
  return best;
}

double spread(const std::vector<Choice>& choices) {
  double sum = 0.0;
  for (std::size_t p = 0; p < choices.size(); ++p) {
    for (std::size_t q = 0; q < p; ++q) {
      const double d = choices[p].delay_rad - choices[q].delay_rad;
      sum += std::abs(choices[p].weight_rad * choices[q].weight_rad) * d * d;
    }
  }
  return sum;
}

/// The group around that pattern's delay which is most compact.
std::vector<Choice> most_compact(const std::vector<SelfSimilarity>& same,
                                 std::span<const MotionParameters> patterns, Eigen::Index row,
                                 Eigen::Index source) {
  std::vector<Choice> best, now(patterns.size());
  double best_spread = std::numeric_limits<double>::infinity();
  for (const MotionParameters& around : patterns) {
    const double target = around.delay_rad(row, source);
    for (std::size_t p = 0; p < patterns.size(); ++p) {
      now[p] = nearest_choice(same, patterns[p].delay_rad(row, source),
                              patterns[p].weight_rad(row, source), target);
    }
    const double s = spread(now);
    if (s < best_spread * (1.0 - 1e-12)) {
      best_spread = s;
      best = now;
    }
  }
  double mean = 0.0;
  for (const Choice& c : best) mean += c.delay_rad / static_cast<double>(best.size());
  const double turns = mean - math::wrap_pi(mean);
  for (Choice& c : best) c.delay_rad -= turns;
  return best;
}

}  // namespace

std::vector<SelfSimilarity> self_similarities(const Eigen::Ref<const Eigen::RowVectorXd>& source,
                                              double min_similarity) {
  std::vector<SelfSimilarity> found = {{0.0, 1.0}};
  const Eigen::VectorXd power = harmonic_power(source);
  if (power.size() == 0 || power.sum() <= 0.0) return found;
  const int grid = 16 * static_cast<int>(source.size());
  const double step = math::kTwoPi / grid;
  // around the circle from just before -π; fractions of the period lie between the points
  double slope = autocorrelation(power, -std::numbers::pi - 0.5 * step).slope;
  for (int i = 0; i < grid; ++i) {
    double shift = i * step - std::numbers::pi;
    const double before = slope;
    slope = autocorrelation(power, shift + 0.5 * step).slope;
    if (before * slope > 0.0) continue;
    for (int newton = 0; newton < 8; ++newton) {
      const Correlation r = autocorrelation(power, shift);
      if (r.curvature == 0.0) break;
      shift -= std::clamp(r.slope / r.curvature, -step, step);
    }
    const Correlation r = autocorrelation(power, shift);
    // a maximum above zero, or a minimum below it
    if (r.value * r.curvature >= 0.0 || std::abs(r.value) < min_similarity - 1e-9) continue;
    if (std::abs(math::wrap_pi(shift)) > step) found.push_back({math::wrap_pi(shift), r.value});
  }
  return found;
}

Disambiguation remove_delay_ambiguities(const Eigen::MatrixXd& sources, int fixed,
                                        std::span<MotionParameters> patterns,
                                        double min_similarity) {
  Disambiguation done;
  if (patterns.empty()) return done;
  for (Eigen::Index k = fixed; k < sources.rows(); ++k) {
    const auto same = self_similarities(sources.row(k), min_similarity);
    for (Eigen::Index r = 0; r < patterns[0].weight_rad.rows(); ++r) {
      const bool tied = std::ranges::all_of(patterns, [&](const MotionParameters& p) {
        return p.delay_rad(r, k) == patterns[0].delay_rad(r, k);
      });
      if (tied) continue;
      const auto chosen = most_compact(same, patterns, r, k);
      for (std::size_t p = 0; p < patterns.size(); ++p) {
        double& delay = patterns[p].delay_rad(r, k);
        double& weight = patterns[p].weight_rad(r, k);
        const Choice& c = chosen[p];
        if (std::abs(math::wrap_pi(delay - c.delay_rad)) > 1e-9) ++done.changed;
        done.worst_error_rad = std::max(
            done.worst_error_rad,
            std::abs(weight) * std::sqrt(std::max(0.0, 1.0 - c.similarity * c.similarity)));
        delay = c.delay_rad;
        weight = c.weight_rad;
      }
    }
  }
  return done;
}

}  // namespace mimesis::synthesizer
