#pragma once
#include <span>
#include <vector>

namespace mimesis::synthesizer {

/// The shares of styles of one character over time. A wish with a duration goes there on a quintic
/// (minimum jerk from the shares and their rates as they are); one without is an event-based
/// transition [M18 eq. 3.23] around the next phase 0. Shares have no jump, nor have their rates
/// when wishes follow each other.
class StyleCourse {
 public:
  /// All of style `first`. @param beta  β of eq. 3.23, in (0, 1]
  StyleCourse(int styles, int first, double beta);

  /// Shares >= 0 of sum 1, one per style. A wish in place of one not yet begun replaces it.
  /// duration_s = 0: around the next phase 0, or, of a character that stands, in kStandingChange_s.
  void wish(std::span<const double> shares, double duration_s);
  /// Advances to a step with this phase. Does not allocate.
  void advance(double dt_s, double phase_rad, bool standing);

  std::span<const double> shares() const { return share_; }
  bool changing() const { return event_ != Event::none || time_s_ < duration_s_; }
  int largest() const;

  static constexpr double kStandingChange_s = 0.6;
  static constexpr double kShortest_s = 0.2;  ///< shorter durations are as long

 private:
  enum class Event { none, announced, begun };
  void start_course(std::span<const double> shares, double duration_s);
  void follow_event(double phase_rad);

  double beta_;
  std::vector<double> share_, rate_;           // now; rate [1/s]
  std::vector<double> from_, from_rate_, to_;  // of the course in time
  double time_s_ = 0.0, duration_s_ = 0.0;     // of that course
  Event event_ = Event::none;
  std::vector<double> next_;                    // of the event
  double event_phase_rad_ = 0.0, alpha_ = 0.0;  // since the event; α
  double phase_rad_ = 0.0;                      // at the last advance
};

}  // namespace mimesis::synthesizer
