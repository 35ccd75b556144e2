#pragma once
#include <Eigen/Core>
#include <array>
#include <span>
#include <vector>

#include "nodes/walker/filter/whole_body.h"
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Turns a ZMP change Δz that is known at a few samples ahead into a shift of the CoM by preview
/// control [Kajita 2003]. Interpolation and control are linear, so both are matrices that are made
/// once, and a tick costs a few products. Between samples Δz is a cubic of continuous slope.
///
/// Past the last sample one thing is known: Δz = L̇ / (m g) about an axis along the ground, with L
/// the angular momentum about the CoM, and in a walk L comes back to its mean. So Δz fades there,
/// and its integral since the start goes back to its mean [docs/walking.md 5.3].
class Correction {
 public:
  /// Rows: p, v, a of the shift and ∫ Δz dt [m s]; columns: x, y. The integral forgets within
  /// seconds, so its mean is 0.
  using State = Eigen::Matrix<double, 4, 2>;
  using Errors = Eigen::Matrix<double, Eigen::Dynamic, 2>;  ///< Δz at the samples [m]

  Correction(double com_height_m, int samples, int ticks_a_sample);

  State next(const State& now, const Errors& wished) const;
  /// Shift at a sample ahead if nothing changes.
  ComState at(int sample, const State& now, const Errors& wished) const;
  /// at() one tick after the sample: the sample's time when the next tick looks ahead.
  ComState at_in_next_tick(int sample, const State& now, const Errors& wished) const;

 private:
  /// The shift at all samples, linear in state and Δz: 3 rows per sample.
  struct Forecast {
    Eigen::Matrix<double, Eigen::Dynamic, 4> by_state;
    Eigen::MatrixXd by_wish;
    ComState at(int sample, const State& now, const Errors& wished) const;
  };

  Eigen::Matrix3d A_;
  Eigen::Vector3d b_;
  Eigen::RowVector4d by_state_;    ///< ∂ jerk / ∂ state
  Eigen::RowVectorXd per_sample_;  ///< ∂ jerk / ∂ Δz at every sample
  Forecast forecast_, forecast_in_next_tick_;
};

ComState to_com(const Correction::State& state);

struct FilterSettings {
  double window_s = 0.7;   ///< length of the window ahead
  int samples = 20;        ///< samples in the window, evenly spaced
  int iterations = 1;      ///< passes of inverse dynamics and correction per tick
  bool legs_only = false;  ///< upper body taken as at rest in half-sitting, for comparison
};

/// Corrects the pattern for the part of the dynamics that the cart-table model leaves out
/// [M18 3.8.2; Yamane and Nakamura 2003; Nishiwaki 2009; docs/walking.md 5]. Full-body inverse
/// dynamics over a window gives the ZMP that the robot would have; preview control turns its error
/// into a shift of the CoM. Since the shifted CoM moves the legs differently, each pass starts from
/// the shift that the last one found, the first pass of a tick from that of the last tick: one pass
/// per tick converges over the ticks, and more change nothing in a steady walk. The error that
/// preview control leaves is known from its own linear forecast; a second stage, which needs no
/// dynamics, halves it.
class DynamicFilter {
 public:
  /// The biped outlives it.
  DynamicFilter(const robot::Biped& biped, const GaitSettings& gait,
                const FilterSettings& settings);

  void reset();
  /// Shift of the CoM for this tick. `upper[k]` is the upper body k · window/samples ahead; a
  /// single element stands for the whole window. Not empty. No allocation.
  ComState step(const PatternGenerator& pattern, std::span<const UpperBody> upper);
  /// Ticks between two samples of `upper`.
  int ticks_a_sample() const { return ticks_a_sample_; }
  /// Number of samples of the last window in which a leg was too short, so that accelerations are
  /// guesses.
  int unreachable() const { return unreachable_; }

 private:
  struct Stage {
    Correction::State state;
    Correction::Errors wished;  ///< Δz by sample
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
  WholeBody::Moments rest_moments_;  ///< moments of rest_
  std::array<Stage, 2> stage_;       ///< a third leaves 1.0 mm instead of 1.2 mm in x at 0.3 m/s
  // One element per sample:
  std::vector<PatternSample> plan_;
  std::vector<ComState> shift_;  ///< shift found by the last iteration
  std::vector<WholeBody::Moments> moments_;
  std::vector<WholeBody::Lever> lever_;  ///< one per sample and iteration
  int unreachable_ = 0;
};

}  // namespace mimesis::walker
