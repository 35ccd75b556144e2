#pragma once
#include <vector>

#include "nodes/walker/pattern/footsteps.h"
#include "nodes/walker/pattern/standing.h"
#include "nodes/walker/pattern/steps.h"

namespace mimesis::walker {

/// Walking by preview control [Kajita 2003]: landings are placed by the wished velocity two steps
/// ahead and stay once their swing has begun; the ZMP's reference goes through the feet, crossing
/// from one to the other while both stand; preview control of the CoM with the sum of the error
/// follows it.
class PreviewPattern final : public PatternGenerator {
 public:
  /// @throws ConfigError if `settings` make no sense (check())
  explicit PreviewPattern(const GaitSettings& settings);
  void reset(const std::array<Footprint, 2>& feet) override;
  /// Goes on from where another generator is; `last_jerk` led to `com` in its last tick.
  void take_over(const Steps& steps, const ComState& com, const Eigen::Vector2d& last_jerk);
  const Steps& steps() const { return steps_; }
  void step(const Wish& wish) override;
  const PatternSample& now() const override { return sample_; }
  PatternSample ahead(int ticks_ahead) const override;
  const PatternTrouble& trouble() const override { return trouble_; }
  void shift(const Eigen::Vector2d& shift_W_m) override;

 private:
  void place_feet(const FeasibleWish& wish);
  void refer();
  Eigen::Vector2d centre_after(int ticks) const;

  GaitSettings settings_;
  Footsteps footsteps_;
  Steps steps_;
  PreviewControl control_;
  std::vector<Eigen::Vector2d> centre_;     // of the support: the last ones, now, the coming ones
  std::vector<Eigen::Vector2d> reference_;  // of the ZMP from now on
  std::vector<ComState> coms_;              // from the tick before now on
  PatternSample sample_;
  PatternTrouble trouble_;
};

}  // namespace mimesis::walker
