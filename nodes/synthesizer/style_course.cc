#include "nodes/synthesizer/style_course.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/control/transition.h"
#include "nodes/synthesizer/fade.h"

namespace mimesis::synthesizer {
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
