#include "nodes/crowd/certificate/rate_fit.h"

#include <cmath>

namespace mimesis::crowd {
namespace {

constexpr double kFall = 2.0;  // of log R
constexpr double kSamples = 8.0;

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
  if (count_ < kSamples || std::abs(first_y_ - last_y_) < kFall || !(var_t_ > 0.0)) {
    return std::nullopt;
  }
  return -cov_ / var_t_;
}

std::optional<double> RateFit::reaches_s(double value) const {
  const auto rate = rate_1_s();
  if (!rate) return std::nullopt;
  return origin_s_ + mean_t_ + (mean_y_ - std::log(value)) / *rate;
}

}  // namespace mimesis::crowd
