#pragma once
#include <Eigen/Core>

#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Preview control [Kajita 2003] of a ZMP change that is known at a few samples ahead, to a shift
/// of the CoM. Interpolation and control are linear, so both are matrices made once: a tick costs a
/// few products. Between samples the wish is a cubic of continuous slope.
///
/// Past the last sample nothing is known but this: the wish is L̇ / (m g) about an axis along the
/// ground, L the robot's angular momentum about its CoM, and L of a walk comes back to its mean. So
/// the wish fades there, and its integral since the start goes back to where it is in the mean.
class Correction {
 public:
  /// p, v, a of the shift and ∫ wish dt [m s] by x, y. The integral forgets within seconds: then
  /// its mean is 0.
  using State = Eigen::Matrix<double, 4, 2>;
  using Errors = Eigen::Matrix<double, Eigen::Dynamic, 2>;  ///< wished change of the ZMP [m]

  Correction(double com_height_m, int samples, int ticks_a_sample);

  /// One tick on.
  State next(const State& now, const Errors& wished) const;
  /// What the shift will be at sample `k` if nothing changes.
  ComState at(int sample, const State& now, const Errors& wished) const;
  /// The same a tick after it: where this sample will be when the next tick looks ahead.
  ComState at_in_next_tick(int sample, const State& now, const Errors& wished) const;

 private:
  /// Where the shift will be, linear in state and wish: 3 rows a sample.
  struct Forecast {
    Eigen::Matrix<double, Eigen::Dynamic, 4> by_state;
    Eigen::MatrixXd by_wish;
    ComState at(int sample, const State& now, const Errors& wished) const;
  };

  Eigen::Matrix3d A_;
  Eigen::Vector3d b_;
  Eigen::RowVector4d by_state_;    ///< jerk by the state
  Eigen::RowVectorXd per_sample_;  ///< jerk by the wish at every sample
  Forecast forecast_, forecast_in_next_tick_;
};

ComState to_com(const Correction::State& state);

}  // namespace mimesis::walker
