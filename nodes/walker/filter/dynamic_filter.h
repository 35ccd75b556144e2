#pragma once
#include <span>
#include <vector>

#include "nodes/walker/filter/correction.h"
#include "nodes/walker/filter/whole_body.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

struct FilterSettings {
  /// Of the correction. With 0.7 s [walking.md 1.5] what comes after it leaves 2.7 mm in x after
  /// two iterations at 0.3 m/s, with 1.1 s 1 mm at the same cost; longer is too coarse for 20
  /// samples.
  double window_s = 1.1;
  int samples = 20;        ///< in it, evenly
  int iterations = 1;      ///< of correction and inverse dynamics a tick
  bool legs_only = false;  ///< upper body taken as at rest in half-sitting, for comparison
};

/// Correction of the pattern for what the cart-table model leaves out [M18 3.8.2; Yamane and
/// Nakamura 2003; Nishiwaki 2009]: full-body inverse dynamics over a window gives the ZMP that the
/// robot would have; preview control turns its error into a shift of the CoM.
class DynamicFilter {
 public:
  /// The biped outlives it. @throws ConfigError that names window, samples or iterations
  DynamicFilter(const robot::Biped& biped, const GaitSettings& gait,
                const FilterSettings& settings);

  void reset();
  /// Shift of the CoM for this tick. `upper(k)` belongs to k · window/samples ahead; one element:
  /// it stays so. Not empty. No allocation.
  ComState step(const PatternGenerator& pattern, std::span<const UpperBody> upper);
  /// Ticks between two samples: where `upper` is looked at.
  int ticks_a_sample() const { return ticks_a_sample_; }
  /// ZMP of the whole robot, upper body and all, at this tick before and after the correction
  /// (multi-body − planned).
  Eigen::Vector2d error_before_m() const { return error_before_; }
  Eigen::Vector2d error_after_m() const { return error_after_; }
  /// Samples of the last window in which a leg was too short; their accelerations are guesses.
  int unreachable() const { return unreachable_; }

 private:
  /// Of one iteration: what its preview control has done so far.
  using State = Correction::State;
  Eigen::Vector2d error(const PatternSample& sample, const ComState& com, const UpperBody& upper,
                        const WholeBody::Moments& moments, WholeBody::Lever& lever);

  FilterSettings settings_;
  int ticks_a_sample_;
  WholeBody body_;
  Correction correction_;
  UpperBody rest_;                   ///< half-sitting
  WholeBody::Moments rest_moments_;  ///< of it
  std::vector<State> state_;         ///< of every iteration
  std::vector<PatternSample> plan_;
  std::vector<ComState> com_;  ///< planned and corrected by the iterations so far
  std::vector<WholeBody::Moments> moments_;
  std::vector<WholeBody::Lever> lever_;  ///< of every iteration's samples, then of this tick's two
  Correction::Errors wanted_;            ///< change of the ZMP, by sample
  Eigen::Vector2d error_before_ = Eigen::Vector2d::Zero(), error_after_ = Eigen::Vector2d::Zero();
  int unreachable_ = 0;
};

}  // namespace mimesis::walker
