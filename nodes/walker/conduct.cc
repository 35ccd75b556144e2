#include "nodes/walker/conduct.h"

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
  const bool powered = phase_ != Phase::kWaiting && phase_ != Phase::kArming;
  if (powered && !now.actuators.empty()) {
    fell_ = false;
    enter(Phase::kWaiting, now.actuators);
    return phase_;
  }
  switch (phase_) {
    case Phase::kWaiting:
      wait(now, dt_s);
      break;
    case Phase::kArming:
      arm(now);
      break;
    case Phase::kApproaching:
      approach(now);
      break;
    case Phase::kBalancing:
      balance(now, dt_s);
      break;
    case Phase::kSafe:
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
    enter(Phase::kArming, now.actuators);
  }
}

void Conduct::arm(const Condition& now) {
  const std::string_view why = first(now.sensors, now.posture);
  if (!why.empty()) {
    enter(Phase::kWaiting, why);
  } else if (now.actuators.empty()) {
    enter(Phase::kApproaching, kOnTheWay);
  } else {
    reason_ = now.actuators;
  }
}

void Conduct::approach(const Condition& now) {
  const std::string_view why = first(now.sensors, now.posture);
  if (!why.empty()) {
    enter(Phase::kSafe, why);
  } else if (now.approached) {
    enter(Phase::kBalancing, {});
  }
}

void Conduct::balance(const Condition& now, double dt_s) {
  if (!now.falling.empty()) {
    enter(Phase::kSafe, now.falling);
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
    enter(Phase::kSafe, std::string(reason_));
  }
}

void Conduct::hold(const Condition& now, double dt_s) {
  if (fell_) return;
  well_for_s_ = first(now.sensors, now.posture).empty() ? well_for_s_ + dt_s : 0.0;
  if (well_for_s_ >= settings_.recovery_s) enter(Phase::kApproaching, kOnTheWay);
}

}  // namespace mimesis::walker
