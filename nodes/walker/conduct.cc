#include "nodes/walker/conduct.h"

#include <algorithm>
#include <cmath>

#include "common/math/minimum_jerk.h"

namespace mimesis::walker {
namespace {

constexpr std::string_view kOnTheWay = "on the way to half-sitting";

std::string_view first(std::string_view a, std::string_view b) { return a.empty() ? b : a; }

}  // namespace

void Conduct::enter(Phase phase, std::string_view reason) {
  phase_ = phase;
  reason_ = reason;
  waited_s_ = blind_for_s_ = well_for_s_ = 0.0;
}

Phase Conduct::step(const Condition& now, double dt_s) {
  const bool powered = phase_ != Phase::waiting && phase_ != Phase::arming;
  if (powered && !now.actuators.empty()) {
    fell_ = false;
    enter(Phase::waiting, now.actuators);
    return phase_;
  }
  switch (phase_) {
    case Phase::waiting:
      wait(now, dt_s);
      break;
    case Phase::arming:
      arm(now);
      break;
    case Phase::approaching:
      approach(now);
      break;
    case Phase::balancing:
      balance(now, dt_s);
      break;
    case Phase::safe:
      hold(now, dt_s);
      break;
  }
  return phase_;
}

void Conduct::wait(const Condition& now, double dt_s) {
  waited_s_ += dt_s;
  const std::string_view why = first(now.sensors, now.posture);
  if (!why.empty()) {
    reason_ = why;
  } else if (waited_s_ >= settings_.silence_s) {
    enter(Phase::arming, now.actuators);
  }
}

void Conduct::arm(const Condition& now) {
  const std::string_view why = first(now.sensors, now.posture);
  if (!why.empty()) {
    enter(Phase::waiting, why);
  } else if (now.actuators.empty()) {
    enter(Phase::approaching, kOnTheWay);
  } else {
    reason_ = now.actuators;
  }
}

void Conduct::approach(const Condition& now) {
  const std::string_view why = first(now.sensors, now.posture);
  if (!why.empty()) {
    enter(Phase::safe, why);
  } else if (now.approached) {
    enter(Phase::balancing, {});
  }
}

void Conduct::balance(const Condition& now, double dt_s) {
  if (!now.falling.empty()) {
    enter(Phase::safe, now.falling);
    fell_ = true;
    return;
  }
  if (now.sensors.empty()) {
    blind_for_s_ = 0.0;
    reason_.clear();
    return;
  }
  blind_for_s_ += dt_s;
  reason_ = now.sensors;
  if (now.stands || blind_for_s_ > settings_.blind_s) {
    enter(Phase::safe, std::string(reason_));
  }
}

void Conduct::hold(const Condition& now, double dt_s) {
  if (fell_) return;
  well_for_s_ = first(now.sensors, now.posture).empty() ? well_for_s_ + dt_s : 0.0;
  if (well_for_s_ >= settings_.recovery_s) enter(Phase::approaching, kOnTheWay);
}

void Approach::start(const Eigen::VectorXd& from, const Eigen::VectorXd& to,
                     const Eigen::VectorXd& max_speed, double speed_share, double least_s) {
  from_ = from;
  way_ = to - from;
  q_ = from;
  dq_.setZero(from.size());
  t_s_ = 0.0;
  duration_s_ = least_s;
  for (Eigen::Index j = 0; j < way_.size(); ++j) {
    const double least = math::kMinimumJerkPeak * std::abs(way_[j]) / (speed_share * max_speed[j]);
    duration_s_ = std::max(duration_s_, least);
  }
}

void Approach::step(double dt_s) {
  t_s_ = std::min(t_s_ + dt_s, duration_s_);
  const double s = duration_s_ > 0.0 ? t_s_ / duration_s_ : 1.0;
  q_ = from_ + math::minimum_jerk(s) * way_;
  dq_ = way_ * (math::minimum_jerk_rate(s) / std::max(duration_s_, dt_s));
}

}  // namespace mimesis::walker
