#pragma once
#include <optional>

#include "experiments/motion/least_jerk.h"
#include "nodes/synthesizer/character/parameters.h"

namespace mimesis::synthesizer {

/// Plays actions one after the other by the phase of the leading oscillator: each lasts from phase
/// 0 to 2π and the next one, if there is any, takes over around phase 0. The last is repeated.
class Sequencer {
 public:
  static constexpr double kBeta = 0.2;  ///< β of [M18 3.4.1]

  /// Starts in the middle of nothing: `first` alone. β in (0, 1]; the sizes are those of all
  /// actions. @throws ConfigError if β is outside or `fixed` is more than the sources.
  Sequencer(MotionParameters first, int fixed, double phase_rad = 0.0, double beta = kBeta);

  /// Transitions to come go by LeastJerkTransition instead of eq. 3.23: smoother between actions
  /// that differ much. `model`: whose parameters are played. @throws ConfigError if it cannot be
  /// played or has another number of rows or sources.
  void use_least_jerk(const motion::MotionModel& model);

  /// Announces the action that follows at the next crossing of phase 0, in place of one announced
  /// before. Returns false and changes nothing if that transition has begun already (the phase is
  /// within βπ before the crossing): announce again after it. Does not allocate.
  [[nodiscard]] bool announce(const MotionParameters& next);

  /// The parameters at a phase of the leading oscillator (any whole turns). Successive phases
  /// differ by less than half a turn; small steps back are followed. Does not allocate.
  const MotionParameters& at(double phase_rad);

  bool in_transition() const;
  bool announced() const { return announced_; }
  /// Actions begun since the start; grows by one at a crossing where one was announced.
  int transitions() const { return transitions_; }

 private:
  void cross();
  void blend(const MotionParameters& from, const MotionParameters& to, double phase);

  int fixed_;
  double beta_;
  double last_rad_;           // phase at the last call
  double in_action_rad_;      // since the last crossing, in [0, 2π)
  bool blending_in_ = false;  // the current action came by a transition that is not over
  bool announced_ = false;
  int transitions_ = 0;
  MotionParameters previous_, current_, next_, out_;
  std::optional<LeastJerkTransition> least_jerk_;
  bool prepared_ = false;  // least_jerk_, for the current transition
};

}  // namespace mimesis::synthesizer
