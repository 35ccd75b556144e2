#include "nodes/synthesizer/character/courses.h"

#include <algorithm>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/character/parameters.h"
#include "nodes/synthesizer/character/smooth.h"

namespace mimesis::synthesizer {

Strike strike_between(double before_rad, double after_rad) {
  const double a = math::wrap_two_pi(before_rad), turn = math::wrap_pi(after_rad - before_rad);
  if (turn <= 0.0) return Strike::none;
  if (a < std::numbers::pi && a + turn >= std::numbers::pi) return Strike::right;
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
      if (strike == Strike::none || progress_rad_ < 0.5 * std::numbers::pi) return Strike::none;
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
      return transition_weight(progress_rad_ - 0.5 * std::numbers::pi, kBeta);
    case Stage::closing:
      return transition_weight(0.5 * std::numbers::pi - progress_rad_, kBeta);
    case Stage::walking:
      break;
  }
  return 1.0;
}

namespace {

/// In the half of a transition that lies before phase 0.
bool before_event(double phase_rad, double beta) {
  const double phi = math::wrap_pi(phase_rad);
  return phi < 0.0 && phi > -beta * std::numbers::pi;
}

}  // namespace

StyleCourse::StyleCourse(int styles, int first, double beta)
    : beta_(beta), share_(static_cast<std::size_t>(styles), 0.0) {
  MIMESIS_ASSERT(first >= 0 && first < styles && beta > 0.0 && beta <= 1.0);
  share_[static_cast<std::size_t>(first)] = 1.0;
  rate_.assign(share_.size(), 0.0);
  from_ = to_ = next_ = share_;
  from_rate_ = rate_;
}

void StyleCourse::wish(std::span<const double> shares, double duration_s) {
  MIMESIS_ASSERT(shares.size() == share_.size());
  if (duration_s > 0.0) {
    start_course(shares, std::max(duration_s, kShortest_s));
    return;
  }
  if (event_ == Event::begun) {  // from where it is, at the next phase 0
    start_course(share_, kShortest_s);
  }
  std::ranges::copy(shares, next_.begin());
  event_ = Event::announced;
}

void StyleCourse::start_course(std::span<const double> shares, double duration_s) {
  from_ = share_;
  from_rate_ = rate_;
  std::ranges::copy(shares, to_.begin());
  time_s_ = 0.0;
  duration_s_ = duration_s;
  event_ = Event::none;
}

void StyleCourse::advance(double dt_s, double phase_rad, bool standing) {
  if (standing && event_ != Event::none) start_course(next_, kStandingChange_s);
  if (!changing()) {
    phase_rad_ = phase_rad;
    return;
  }
  time_s_ = std::min(time_s_ + dt_s, duration_s_);
  const double u = duration_s_ > 0.0 ? time_s_ / duration_s_ : 1.0;
  const double there = 1.0 - fade_value(u), by_rate = duration_s_ * fade_rate(u);
  follow_event(phase_rad);
  for (std::size_t s = 0; s < share_.size(); ++s) {
    const double base = from_[s] + there * (to_[s] - from_[s]) + by_rate * from_rate_[s];
    const double share = base + alpha_ * (next_[s] - base);
    rate_[s] = (share - share_[s]) / dt_s;
    share_[s] = share;
  }
  if (event_ == Event::begun && alpha_ >= 1.0) {  // the event is over: it is the course now
    event_ = Event::none;
    alpha_ = 0.0;
    share_ = from_ = to_ = next_;
    std::ranges::fill(rate_, 0.0);
    time_s_ = duration_s_ = 0.0;
  }
  if (!changing()) std::ranges::fill(rate_, 0.0);
}

void StyleCourse::follow_event(double phase_rad) {
  alpha_ = 0.0;
  const bool enters = before_event(phase_rad, beta_) && !before_event(phase_rad_, beta_);
  if (event_ == Event::announced && enters) {
    event_ = Event::begun;
    event_phase_rad_ = math::wrap_pi(phase_rad);
  } else if (event_ == Event::begun) {
    event_phase_rad_ += math::wrap_pi(phase_rad - phase_rad_);
  }
  if (event_ == Event::begun) alpha_ = transition_weight(event_phase_rad_, beta_);
  phase_rad_ = phase_rad;
}

int StyleCourse::largest() const {
  return static_cast<int>(std::ranges::max_element(share_) - share_.begin());
}

}  // namespace mimesis::synthesizer
