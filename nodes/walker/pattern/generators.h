#pragma once
#include <vector>

#include "nodes/walker/pattern/mpc_problem.h"
#include "nodes/walker/pattern/preview_control.h"
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
  /// Continues from the state of another generator; `last_jerk` led to `com` in its last tick.
  void take_over(const Steps& steps, const ComState& com, const Eigen::Vector2d& last_jerk);
  const Steps& steps() const { return steps_; }
  void step(const Wish& wish) override;
  PatternSample ahead(int ticks_ahead) const override;
  void shift(const Eigen::Vector2d& shift_W_m) override;

 private:
  void place_feet(const FeasibleWish& wish);
  void refer();
  Eigen::Vector2d centre_after(int ticks) const;

  GaitSettings settings_;
  Footsteps footsteps_;
  Steps steps_;
  PreviewControl control_;
  std::vector<Eigen::Vector2d> centre_;     // middle of the support: past ticks, now, coming ticks
  std::vector<Eigen::Vector2d> reference_;  // ZMP from now on
  std::vector<ComState> coms_;              // prediction, beginning one tick before now
};

/// Walking by model predictive control: every tick a quadratic program gives the jerk of the CoM
/// and the next two landings. If it has no solution the last plan is followed for 0.2 s; then
/// preview control, which needs no program, takes over and stops within two steps. After that the
/// robot walks again as soon as there is a solution.
class MpcPattern : public PatternGenerator {
 public:
  void reset(const std::array<Footprint, 2>& feet) override;
  void step(const Wish& wish) override;
  PatternSample ahead(int ticks_ahead) const override;
  void shift(const Eigen::Vector2d& shift_W_m) override;

  /// The quadratic program of the last tick that had one, and how it was solved.
  const qp::Problem* problem() const { return problem_ ? &*problem_ : nullptr; }
  void forget() { qp_.forget(); }  ///< the next program is solved cold
  int iterations() const { return qp_.iterations(); }
  /// Limit on the iterations of every program; 0: enough for any.
  void limit_iterations(int most) { qp_.limit_iterations(most); }

 protected:
  /// @throws ConfigError if `settings` make no sense (check())
  MpcPattern(const GaitSettings& settings, bool yaw_free, const MpcWeights& weights);

 private:
  bool plan(const FeasibleWish& wish, bool turn_feet);
  void place_feet(const FeasibleWish& wish, bool turn_feet);
  void take_solution(const FeasibleWish& wish);
  void advance_tick();
  void stop_without_programs();
  void predict();
  ComState com_after(int ticks) const;

  GaitSettings settings_;
  bool yaw_free_;
  Footsteps footsteps_;
  Steps steps_;
  Standing standing_;
  MpcProblem mpc_;
  qp::DualQp qp_;
  std::optional<qp::Problem> problem_;
  MpcInput input_;
  std::vector<Eigen::Vector2d> jerk_;  // by interval
  std::vector<ComState> node_;         // at the intervals' beginnings and at the end of the last
  int first_ticks_ = kSampleTicks;     // length of the first interval
  ComState com_;
  Eigen::Vector2d last_jerk_ = Eigen::Vector2d::Zero();
  int failed_ticks_ = 0;    // consecutive ones
  bool gave_up_ = false;    // the stopper is in charge
  PreviewPattern stopper_;  // takes over after too many failed ticks
};

/// MPC of Herdt 2010: the yaw of the feet is decided from the wished yaw rate before the program.
class LinearMpc final : public MpcPattern {
 public:
  explicit LinearMpc(const GaitSettings& settings, const MpcWeights& weights = {})
      : MpcPattern(settings, false, weights) {}
};

/// MPC of Naveau 2017: the yaw of the feet is free, one step of sequential quadratic programming
/// per tick.
class NonlinearMpc final : public MpcPattern {
 public:
  explicit NonlinearMpc(const GaitSettings& settings, const MpcWeights& weights = {})
      : MpcPattern(settings, true, weights) {}
};

}  // namespace mimesis::walker
