#include "experiments/motion/turning.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mimesis::synthesizer {

TurnRates turn_rates(const mocap::Trial& left, const mocap::Trial& straight,
                     const mocap::Trial& right) {
  const auto rate = [](const mocap::Trial& t) {
    if (!(t.duration_s > 0.0) || !std::isfinite(t.turn_rad)) {
      throw ConfigError("turning: '" + t.clip + "' has no duration or turn");
    }
    return t.turn_rad / t.duration_s;
  };
  const TurnRates r{rate(left), rate(straight), rate(right)};
  if (!(r.left > r.straight && r.straight > r.right)) {
    throw ConfigError("turning: '" + left.clip + "', '" + straight.clip + "', '" + right.clip +
                      "' turn by " + std::to_string(r.left) + ", " + std::to_string(r.straight) +
                      ", " + std::to_string(r.right) + " rad/s, expected left > straight > right");
  }
  return r;
}

std::array<double, 3> turn_shares(const TurnRates& rates, double rate_rad_s) {
  const double off = rate_rad_s - rates.straight;
  if (off >= 0.0) {
    const double a = std::min(1.0, off / (rates.left - rates.straight));
    return {a, 1.0 - a, 0.0};
  }
  const double a = std::min(1.0, off / (rates.right - rates.straight));
  return {0.0, 1.0 - a, a};
}

MotionParameters balanced_mixture(const MotionParameters& emotional, const MotionParameters& left,
                                  const MotionParameters& right, double beta) {
  if (!(beta >= -1.0 && beta <= 1.0)) {
    throw ConfigError("balanced mixture: beta is " + std::to_string(beta) +
                      ", expected one in [-1, 1]");
  }
  const std::array parts = {emotional, left, right};
  const std::array shares = {0.75, 0.125 * (1.0 + beta), 0.125 * (1.0 - beta)};
  MotionParameters out;
  blend(parts, shares, out);
  return out;
}

double balancing_beta(double emotional_rad_s, double left_rad_s, double right_rad_s) {
  // 6e + l + r + β(l − r) = 0
  return std::clamp(
      -(6.0 * emotional_rad_s + left_rad_s + right_rad_s) / (left_rad_s - right_rad_s), -1.0, 1.0);
}

}  // namespace mimesis::synthesizer
