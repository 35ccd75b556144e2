#include "nodes/synthesizer/biped/gait_clock.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {
constexpr double kPi = std::numbers::pi;
constexpr double kPull_1_s = 10.0;
constexpr double kNever = 0.9;  // of the clock's rate: what the pull may add or take
}  // namespace

double GaitClock::half() { return kPi; }

double GaitClock::to_landing_s() const {
  return moves_ ? step_s_ * (1.0 - std::fmod(phase_rad_, kPi) / kPi) : 0.0;
}

double GaitClock::wished_rate(const RobotFeedback* feedback, bool walk) {
  const double rate = kPi / step_s_;
  if (feedback == nullptr) {
    moves_ = moves_ || walk;
    return moves_ ? rate : 0.0;
  }
  moves_ = feedback->moves() && feedback->to_landing_s > 0.0;
  if (!moves_) return 0.0;
  const double start = feedback->swing == mocap::kRight ? 0.0 : kPi;
  const double share = std::clamp(1.0 - feedback->to_landing_s / step_s_, 0.0, 1.0);
  const double off = math::wrap_pi(start + kPi * share - phase_rad_);
  // before the first step the weight is shifted: the clock waits where the step begins
  const double own = feedback->to_landing_s > step_s_ ? 0.0 : rate;
  return std::max(0.0, own + std::clamp(kPull_1_s * off, -kNever * rate, kNever * rate));
}

void GaitClock::step(const RobotFeedback* feedback, bool walk) {
  rate_rad_s_ = wished_rate(feedback, walk);
  const double before = phase_rad_;
  phase_rad_ += dt_s_ * rate_rad_s_;
  right_landed_ = before < kPi && phase_rad_ >= kPi;
  left_landed_ = phase_rad_ >= math::kTwoPi;
  if (left_landed_) phase_rad_ -= math::kTwoPi;
  if (feedback == nullptr && !walk && (left_landed_ || right_landed_)) moves_ = false;
}

}  // namespace mimesis::synthesizer
