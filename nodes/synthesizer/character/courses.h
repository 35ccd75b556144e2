#pragma once
#include <algorithm>
#include <numbers>
#include <span>
#include <vector>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/character/parameters.h"
#include "nodes/synthesizer/character/smooth.h"

namespace mimesis::synthesizer {

/// Phases of the gait cycle at which a foot lands: 0 left, π right.
enum class Strike { none, left, right };
inline Strike strike_between(double before_rad, double after_rad) {
  const double a = math::wrap_two_pi(before_rad), turn = math::wrap_pi(after_rad - before_rad);
  if (turn <= 0.0) return Strike::none;
  if (a < std::numbers::pi && a + turn >= std::numbers::pi) return Strike::right;
  if (a + turn >= math::kTwoPi) return Strike::left;
  return Strike::none;
}

/// Starts and stops a walk at the ends of steps: its share g in the motion, the rest is standing.
/// Standing, the phase rests. The opening step lasts half a cycle in which g rises from 0 to 1 as α
/// of [M18 eq. 3.23] with β = 1/2: the foot that swings leaves from beside the other one. A walk
/// that is to end continues to the end of its step, and closes the feet in the half cycle after it,
/// g falling to 0.
class StepCourse {
 public:
  enum class Stage { standing, opening, walking, closing };

  /// @param walking  starts in the middle of a walk
  explicit StepCourse(bool walking) : stage_(walking ? Stage::walking : Stage::standing) {}

  /// @param phase_rad  of the leading oscillator now
  /// @param walk  the wish; counts at the end of a step, and while standing
  /// @return the foot that lands in this step of time
  Strike advance(double phase_rad, bool walk) {
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

  Stage stage() const { return stage_; }
  bool standing() const { return stage_ == Stage::standing; }
  /// g [1]
  double share() const {
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
  /// The phase must move: everything but standing.
  bool moves() const { return stage_ != Stage::standing; }

 private:
  Stage stage_;
  bool fresh_ = true;
  double phase_rad_ = 0.0;     // at the last advance
  double progress_rad_ = 0.0;  // progress of opening and closing
};

/// The shares of styles of one character over time. A wish with a duration goes there on a quintic
/// (minimum jerk from the shares and their rates as they are); one without is an event-based
/// transition [M18 eq. 3.23] around the next phase 0. Shares have no jump, nor have their rates
/// when wishes follow each other.
class StyleCourse {
 public:
  /// All of style `first`. @param beta  β of eq. 3.23, in (0, 1]
  StyleCourse(int styles, int first, double beta)
      : beta_(beta), share_(static_cast<std::size_t>(styles), 0.0) {
    MIMESIS_ASSERT(first >= 0 && first < styles && beta > 0.0 && beta <= 1.0);
    share_[static_cast<std::size_t>(first)] = 1.0;
    rate_.assign(share_.size(), 0.0);
    from_ = to_ = next_ = share_;
    from_rate_ = rate_;
  }

  /// Shares >= 0 of sum 1, one per style. A wish in place of one not yet begun replaces it.
  /// duration_s = 0: around the next phase 0, or, of a character that stands, in kStandingChange_s.
  void wish(std::span<const double> shares, double duration_s) {
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
  /// Advances to a step with this phase. Does not allocate.
  void advance(double dt_s, double phase_rad, bool standing) {
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

  std::span<const double> shares() const { return share_; }
  bool changing() const { return event_ != Event::none || time_s_ < duration_s_; }
  int largest() const {
    return static_cast<int>(std::ranges::max_element(share_) - share_.begin());
  }

  static constexpr double kStandingChange_s = 0.6;
  static constexpr double kShortest_s = 0.2;  ///< shorter durations are as long

 private:
  /// In the half of a transition that lies before phase 0.
  static bool before_event(double phase_rad, double beta) {
    const double phi = math::wrap_pi(phase_rad);
    return phi < 0.0 && phi > -beta * std::numbers::pi;
  }

  enum class Event { none, announced, begun };
  void start_course(std::span<const double> shares, double duration_s) {
    from_ = share_;
    from_rate_ = rate_;
    std::ranges::copy(shares, to_.begin());
    time_s_ = 0.0;
    duration_s_ = duration_s;
    event_ = Event::none;
  }
  void follow_event(double phase_rad) {
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

  double beta_;
  std::vector<double> share_, rate_;           // now; rate [1/s]
  std::vector<double> from_, from_rate_, to_;  // ends of the course in time
  double time_s_ = 0.0, duration_s_ = 0.0;     // time and duration of that course
  Event event_ = Event::none;
  std::vector<double> next_;                    // shares after the event
  double event_phase_rad_ = 0.0, alpha_ = 0.0;  // since the event; α
  double phase_rad_ = 0.0;                      // at the last advance
};

}  // namespace mimesis::synthesizer
