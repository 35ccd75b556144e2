#include "nodes/crowd/certificate/rate_fit.h"

#include <cmath>

namespace mimesis::crowd {

namespace {

constexpr double kFallOfDecay = 2.0;  // fall of log R
constexpr double kLeastSamples = 8.0;

constexpr double kWentOfTurns = 1.0, kLasted_s = 5.0;  // of the logarithm
constexpr double kPause_s = 1.0;

}  // namespace

void RateFit::restart() { *this = RateFit(least_, most_); }

void LogLine::add(double t_s, double value) {
  const double y = std::log(value);
  if (count == 0.0) {
    origin_s = t_s;
    first_y = y;
  }
  last_s = t_s;
  last_y = y;
  const double t = t_s - origin_s;
  count += 1.0;
  const double dt = t - mean_t;
  mean_t += dt / count;
  mean_y += (y - mean_y) / count;
  var_t += dt * (t - mean_t);
  cov += dt * (y - mean_y);
}

void RateFit::add(double t_s, double value) {
  if (!std::isfinite(value) || value < least_) return;
  if (value > most_) {
    restart();
    return;
  }
  line_.add(t_s, value);
}

std::optional<double> RateFit::rate_1_s() const {
  if (line_.count < kLeastSamples || std::abs(line_.first_y - line_.last_y) < kFallOfDecay ||
      !(line_.var_t > 0.0)) {
    return std::nullopt;
  }
  return -line_.cov / line_.var_t;
}

std::optional<double> RateFit::reaches_s(double value) const {
  const auto rate = rate_1_s();
  if (!rate) return std::nullopt;
  return line_.origin_s + line_.mean_t + (line_.mean_y - std::log(value)) / *rate;
}

void TurnFit::Sums::add(const LogLine& turn) {
  if (turn.count < kLeastSamples) return;
  var_t += turn.var_t;
  cov += turn.cov;
  went += std::abs(turn.first_y - turn.last_y);
  lasted_s += turn.last_s - turn.origin_s;
}

void TurnFit::restart() { *this = TurnFit(least_, most_); }

void TurnFit::add(std::uint64_t agent, double t_s, double error) {
  LogLine& turn = turns_[agent];
  const bool taken = error >= least_ && error <= most_;  // false for NaN
  if (turn.count > 0.0 && (!taken || t_s - turn.last_s > kPause_s)) {
    ended_.add(turn);
    turn = {};
  }
  if (taken) turn.add(t_s, error);
}

std::optional<double> TurnFit::rate_1_s() const {
  Sums all = ended_;
  for (const auto& [agent, turn] : turns_) all.add(turn);
  if (!(all.var_t > 0.0) || (all.went < kWentOfTurns && all.lasted_s < kLasted_s)) {
    return std::nullopt;
  }
  return -all.cov / all.var_t;
}

}  // namespace mimesis::crowd
