#include "nodes/synthesizer/step_course.h"

#include <numbers>

#include "common/math/circle.h"
#include "nodes/synthesizer/control/transition.h"

namespace mimesis::synthesizer {
namespace {
constexpr double kPi = std::numbers::pi;
}  // namespace

Strike strike_between(double before_rad, double after_rad) {
  const double a = math::wrap_two_pi(before_rad), turn = math::wrap_pi(after_rad - before_rad);
  if (turn <= 0.0) return Strike::none;
  if (a < kPi && a + turn >= kPi) return Strike::right;
  if (a + turn >= math::kTwoPi) return Strike::left;
  return Strike::none;
}

Strike StepCourse::advance(double phase_rad, bool walk) {
  const double turn = fresh_ ? 0.0 : math::wrap_pi(phase_rad - phase_rad_);
  const Strike strike = fresh_ ? Strike::none : strike_between(phase_rad_, phase_rad);
  fresh_ = false;
  phase_rad_ = phase_rad;
  progress_rad_ += turn;
  switch (stage_) {
    case Stage::standing:
      if (walk) {
        stage_ = Stage::opening;
        progress_rad_ = 0.0;
      }
      return Strike::none;
    case Stage::opening:
    case Stage::closing:
      // the strike it began with may be seen again: phases are computed
      if (strike == Strike::none || progress_rad_ < 0.5 * kPi) return Strike::none;
      stage_ = stage_ == Stage::opening ? Stage::walking : Stage::standing;
      break;
    case Stage::walking:
      break;
  }
  if (stage_ == Stage::walking && strike != Strike::none && !walk) {
    stage_ = Stage::closing;
    progress_rad_ = 0.0;
  }
  return strike;
}

double StepCourse::share() const {
  constexpr double kBeta = 0.5;
  switch (stage_) {
    case Stage::standing:
      return 0.0;
    case Stage::opening:
      return transition_weight(progress_rad_ - 0.5 * kPi, kBeta);
    case Stage::closing:
      return transition_weight(0.5 * kPi - progress_rad_, kBeta);
    case Stage::walking:
      break;
  }
  return 1.0;
}

}  // namespace mimesis::synthesizer
