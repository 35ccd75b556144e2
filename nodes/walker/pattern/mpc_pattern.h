#pragma once
#include "nodes/walker/pattern/mpc_problem.h"
#include "nodes/walker/pattern/preview_pattern.h"
#include "nodes/walker/pattern/standing.h"

namespace mimesis::walker {

/// Walking by model predictive control: every tick a quadratic program gives the jerk of the CoM
/// and the next two landings. If it has no solution the last plan goes on for 0.2 s; then preview
/// control, which solves nothing, takes over and stops within two steps. From standing it walks
/// again when there is a solution.
class MpcPattern : public PatternGenerator {
 public:
  void reset(const std::array<Footprint, 2>& feet) override;
  void step(const Wish& wish) override;
  const PatternSample& now() const override { return sample_; }
  PatternSample ahead(int ticks_ahead) const override;
  const PatternTrouble& trouble() const override { return trouble_; }
  void shift(const Eigen::Vector2d& shift_W_m) override;

  /// The quadratic program of the last tick that had one, and how it was solved.
  const qp::Problem* problem() const { return problem_ ? &*problem_ : nullptr; }
  void forget() { qp_.forget(); }  ///< the next program is solved cold
  int iterations() const { return qp_.iterations(); }
  /// Of every program, for real time; 0: enough for any.
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
  std::vector<Eigen::Vector2d> jerk_;  // of the intervals
  std::vector<ComState> node_;         // at their beginnings and the end of the last
  int first_ticks_ = kSampleTicks;     // of the first interval
  ComState com_;
  Eigen::Vector2d last_jerk_ = Eigen::Vector2d::Zero();
  int failed_ticks_ = 0;    // in a row
  bool gave_up_ = false;    // the stopper walks
  PreviewPattern stopper_;  // takes over when there are no plans for too long
  PatternSample sample_;
  PatternTrouble trouble_;
};

/// Herdt's: the yaw of the feet follows the wished yaw rate, decided before the program.
class LinearMpc final : public MpcPattern {
 public:
  explicit LinearMpc(const GaitSettings& settings, const MpcWeights& weights = {})
      : MpcPattern(settings, false, weights) {}
};

/// Naveau's: the yaw of the feet is free, one step of sequential quadratic programming a tick.
class NonlinearMpc final : public MpcPattern {
 public:
  explicit NonlinearMpc(const GaitSettings& settings, const MpcWeights& weights = {})
      : MpcPattern(settings, true, weights) {}
};

}  // namespace mimesis::walker
