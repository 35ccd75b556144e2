#pragma once
#include <Eigen/Core>

#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Preview control [Kajita 2003] of a ZMP change that is known at a few samples ahead, to a shift
/// of the CoM. Interpolation and control are linear, so both are matrices made once: a tick costs a
/// few products. Between samples the wish is a cubic of continuous slope; past the last one it
/// fades.
class Correction {
 public:
  using State = Eigen::Matrix<double, 3, 2>;                ///< p, v, a by x, y
  using Errors = Eigen::Matrix<double, Eigen::Dynamic, 2>;  ///< wished change of the ZMP [m]

  Correction(double com_height_m, int samples, int ticks_a_sample);

  /// One tick on.
  State next(const State& now, const Errors& wished) const;
  /// What the shift will be at sample `k` if nothing changes.
  ComState at(int sample, const State& now, const Errors& wished) const;

 private:
  Eigen::Matrix3d A_;
  Eigen::Vector3d b_;
  Eigen::RowVector3d K_;
  Eigen::RowVectorXd per_sample_;                      ///< jerk by the wish at every sample
  Eigen::Matrix<double, Eigen::Dynamic, 3> by_state_;  ///< 3 rows a sample
  Eigen::MatrixXd by_wish_;                            ///< 3 rows a sample
};

ComState to_com(const Correction::State& state);

}  // namespace mimesis::walker
