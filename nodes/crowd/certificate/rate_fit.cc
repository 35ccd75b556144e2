#include "nodes/crowd/certificate/rate_fit.h"

#include <cmath>

namespace mimesis::crowd {

namespace {

constexpr double kFallOfDecay = 2.0;  // of log R
constexpr double kLeastSamples = 8.0;

}  // namespace

void RateFit::restart() { *this = RateFit(least_, most_); }

void RateFit::add(double t_s, double value) {
  if (!std::isfinite(value) || value < least_) return;
  if (value > most_) {
    restart();
    return;
  }
  const double y = std::log(value);
  if (count_ == 0.0) {
    origin_s_ = t_s;
    first_y_ = y;
  }
  last_y_ = y;
  const double t = t_s - origin_s_;
  count_ += 1.0;
  const double dt = t - mean_t_;
  mean_t_ += dt / count_;
  mean_y_ += (y - mean_y_) / count_;
  var_t_ += dt * (t - mean_t_);
  cov_ += dt * (y - mean_y_);
}

std::optional<double> RateFit::rate_1_s() const {
  if (count_ < kLeastSamples || std::abs(first_y_ - last_y_) < kFallOfDecay || !(var_t_ > 0.0)) {
    return std::nullopt;
  }
  return -cov_ / var_t_;
}

std::optional<double> RateFit::reaches_s(double value) const {
  const auto rate = rate_1_s();
  if (!rate) return std::nullopt;
  return origin_s_ + mean_t_ + (mean_y_ - std::log(value)) / *rate;
}

namespace {

constexpr double kFallOfTurn = 1.0;  // of the logarithm
constexpr double kPause_s = 1.0;

}  // namespace

bool TurnFit::Turn::counts() const {
  return count >= kLeastSamples && first_y - last_y >= kFallOfTurn;
}

void TurnFit::end(Turn& turn) {
  if (turn.counts()) {
    var_t_ += turn.var_t;
    cov_ += turn.cov;
  }
  turn = {};
}

void TurnFit::restart() {
  var_t_ = cov_ = 0.0;
  turns_.clear();
}

void TurnFit::add(std::uint64_t agent, double t_s, double error) {
  Turn& turn = turns_[agent];
  const bool taken = error >= least_ && error <= most_;  // false for NaN
  if (turn.count > 0.0 && (!taken || t_s - turn.last_s > kPause_s)) end(turn);
  if (!taken) return;
  const double y = std::log(error);
  if (turn.count == 0.0) {
    turn.origin_s = t_s;
    turn.first_y = y;
  }
  turn.last_s = t_s;
  turn.last_y = y;
  turn.count += 1.0;
  const double t = t_s - turn.origin_s, dt = t - turn.mean_t;
  turn.mean_t += dt / turn.count;
  turn.mean_y += (y - turn.mean_y) / turn.count;
  turn.var_t += dt * (t - turn.mean_t);
  turn.cov += dt * (y - turn.mean_y);
}

std::optional<double> TurnFit::rate_1_s() const {
  double var = var_t_, cov = cov_;
  for (const auto& [agent, turn] : turns_) {
    if (!turn.counts()) continue;
    var += turn.var_t;
    cov += turn.cov;
  }
  if (!(var > 0.0)) return std::nullopt;
  return -cov / var;
}

}  // namespace mimesis::crowd
