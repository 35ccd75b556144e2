#pragma once

namespace mimesis::synthesizer {

/// Phases of the gait cycle at which a foot lands: 0 left, π right.
enum class Strike { none, left, right };
Strike strike_between(double before_rad, double after_rad);

/// Starts and stops a walk at the ends of steps: its share g in what the character does, the rest
/// is standing. Standing, the phase rests. The opening step lasts half a cycle in which g rises
/// from 0 to 1 as α of [M18 eq. 3.23] with β = 1/2: the foot that swings leaves from beside the
/// other one. A walk that is to end goes on to the end of its step, and closes the feet in the half
/// cycle after it, g falling to 0.
class StepCourse {
 public:
  enum class Stage { standing, opening, walking, closing };

  /// @param walking  starts in the middle of a walk
  explicit StepCourse(bool walking) : stage_(walking ? Stage::walking : Stage::standing) {}

  /// @param phase_rad  of the leading oscillator now
  /// @param walk  what is wanted; counts at the end of a step, and while standing
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
  double progress_rad_ = 0.0;  // of opening and closing
};

}  // namespace mimesis::synthesizer
