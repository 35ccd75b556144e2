#pragma once
#include <optional>

#include "nodes/synthesizer/control/least_jerk.h"
#include "nodes/synthesizer/control/parameters.h"

namespace mimesis::synthesizer {

/// α of [M18 eq. 3.23]: from 0 to 1 while φ goes from −βπ to βπ, ½ at the transition φ = 0.
/// φ in [−2π, 2π): negative in the previous action, from 0 in the next one.
double transition_weight(double phase_rad, double beta);

/// The parameters at phase φ of a transition. Means and weights of periodic sources go linearly
/// with α. The first `fixed` sources are ramps, s₀ = cos(φ/2) over each action, that jump from −1
/// to +1 at φ = 0; theirs are [M18 after eq. 3.23]
///   w(φ) = sign(φ)[(α − 1) w_prev + α w_post]   (sign(0) = +1),
/// which makes w·s₀ = cos(φ/2)[(α − 1) w_prev + α w_post] without a jump in any derivative at
/// φ = 0. (What the text calls the intermediate value W_trans = (m_prev + m_post)/2 +
/// (w_post − w_prev)/2 is not that of a weight but, with the means, that of the joint angle; the
/// weights arrive at ∓(w_post − w_prev)/2.) Frequencies go with α as in eq. 3.22; delays too, which
/// are the same in all actions of the dissertation.
/// `out` may not be one of the two. Does not allocate if `out` has the size.
void transition(const MotionParameters& previous, const MotionParameters& next, int fixed,
                double phase_rad, double beta, MotionParameters& out);

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
  void use_least_jerk(const MotionModel& model);

  /// Announces what follows at the next crossing of phase 0, in place of what was announced before.
  /// Returns false and changes nothing if that transition has begun already (the phase is within βπ
  /// before the crossing): announce again after it. Does not allocate.
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
  bool prepared_ = false;  // least_jerk_, for the transition that goes on
};

}  // namespace mimesis::synthesizer
