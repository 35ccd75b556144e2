#pragma once
#include "nodes/synthesizer/character/parameters.h"

namespace mimesis::synthesizer {

/// How a periodic source is read between its samples.
enum class Between { linear, cubic };

/// ξᵣ = mᵣ + Σₖ wᵣₖ sₖ(φ − φᵣₖ) [M18 eq. 3.3, 3.14] at phase φ ∈ [0, 2π) of an action. The model's
/// fixed source is the ramp cos(φ/2) in closed form. Zero weights are skipped.
/// `rows`: R. Does not allocate.
void mixture_at(const motion::MotionModel& model, const MotionParameters& p, double phase_rad,
                Between between, Eigen::Ref<Eigen::VectorXd> rows);

/// The same, cubic, at as many even phases as the sources have samples: rows × samples.
Eigen::MatrixXd mixture_rows(const motion::MotionModel& model, const MotionParameters& p);

/// Parameters of a mixture while actions follow each other. The action under way takes new
/// parameters gradually, with time constant `settle_s`; around its ends the mixture goes over to
/// the next one and from the previous one [M18 eq. 3.23], the first source being non-periodic.
class ActionCourse {
 public:
  /// @param beta  half width of a transition, in units of π
  ActionCourse(double beta, double settle_s, double dt_s);

  void want(MotionParameters wanted) { wanted_ = std::move(wanted); }
  const MotionParameters& wanted() const { return wanted_; }
  /// The action under way has the wanted parameters at once, without a transition.
  void restart();

  /// The phase is near the end: the next action must be known.
  bool near_end(double phase_rad) const;
  bool has_next() const { return has_next_; }
  void set_next(MotionParameters next);
  void drop_next() { has_next_ = false; }
  bool has_previous() const { return has_previous_; }
  /// The next action is under way, or the wanted parameters if no next one was set.
  void cross();
  /// Delays go over at once.
  void take_wanted_delays() { current_.delay_rad = wanted_.delay_rad; }

  /// Moves the parameters under way towards the wanted ones for one dt.
  void settle();
  const MotionParameters& at(double phase_rad);
  const MotionParameters& mixed() const { return mixed_; }  ///< result of the last at()

 private:
  double beta_, settling_;  // share of the way to `wanted_` in one dt
  MotionParameters previous_, current_, next_, wanted_, mixed_;
  bool has_previous_ = false, has_next_ = false;
};

}  // namespace mimesis::synthesizer
