#pragma once
#include <array>
#include <span>
#include <vector>

#include "nodes/walker/filter/correction.h"
#include "nodes/walker/filter/whole_body.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

struct FilterSettings {
  double window_s = 0.7;   ///< looked ahead [walking.md 1.5]
  int samples = 20;        ///< in it, evenly
  int iterations = 1;      ///< of correction and inverse dynamics a tick
  bool legs_only = false;  ///< upper body taken as at rest in half-sitting, for comparison
};

/// Correction of the pattern for what the cart-table model leaves out [M18 3.8.2; Yamane and
/// Nakamura 2003; Nishiwaki 2009]: full-body inverse dynamics over a window gives the ZMP that the
/// robot would have; preview control turns its error into a shift of the CoM. The shifted CoM moves
/// the legs differently, so that the error is another one: every iteration begins with the shift
/// that the last one found, the first of a tick with that of the last tick. So one iteration a tick
/// converges over the ticks, and more change nothing in a steady walk. What preview control cannot
/// follow is known from its own linear forecast: a second stage, which costs no dynamics, halves
/// it.
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
  /// Samples of the last window in which a leg was too short; their accelerations are guesses.
  int unreachable() const { return unreachable_; }

 private:
  /// Of preview control.
  struct Stage {
    Correction::State state;
    Correction::Errors wished;  ///< change of the ZMP, by sample
  };
  using Look = ComState (Correction::*)(int, const Correction::State&,
                                        const Correction::Errors&) const;

  void look_ahead(const PatternGenerator& pattern, std::span<const UpperBody> upper);
  const UpperBody& upper_at(std::size_t sample, std::span<const UpperBody> upper) const;

  void share_wish();
  void forecast(Look look);

  FilterSettings settings_;
  int ticks_a_sample_;
  double com_height_;
  WholeBody body_;
  Correction correction_;
  UpperBody rest_;                   ///< half-sitting
  WholeBody::Moments rest_moments_;  ///< of it
  std::array<Stage, 2> stage_;       ///< a third leaves 1.0 mm instead of 1.2 mm in x at 0.3 m/s
  // by sample
  std::vector<PatternSample> plan_;
  std::vector<ComState> shift_;  ///< as the last iteration found it
  std::vector<WholeBody::Moments> moments_;
  std::vector<WholeBody::Lever> lever_;  ///< of every iteration's samples
  int unreachable_ = 0;
};

}  // namespace mimesis::walker
