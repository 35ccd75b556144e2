#pragma once
#include <span>
#include <vector>

namespace mimesis::synthesizer {

/// Phases of the gait cycle at which a foot lands: 0 left, π right.
enum class Strike { none, left, right };
Strike strike_between(double before_rad, double after_rad);

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
  Strike advance(double phase_rad, bool walk);

  Stage stage() const { return stage_; }
  bool standing() const { return stage_ == Stage::standing; }
  double share() const;  ///< g [1]
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
  std::vector<double> from_, from_rate_, to_;  // ends of the course in time
  double time_s_ = 0.0, duration_s_ = 0.0;     // time and duration of that course
  Event event_ = Event::none;
  std::vector<double> next_;                    // shares after the event
  double event_phase_rad_ = 0.0, alpha_ = 0.0;  // since the event; α
  double phase_rad_ = 0.0;                      // at the last advance
};

}  // namespace mimesis::synthesizer
