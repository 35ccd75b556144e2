#pragma once
#include <Eigen/Core>

#include "common/qp/dual_qp.h"

namespace mimesis::walker {

/// A linear MPC of the form of Herdt [2010], closed loop: 16 jerks and 2 foot places an axis, 74
/// one-sided rows, a tick every 5 ms [docs/walking.md 2]. Only the part for a solver; the walker's
/// own program is in pattern/.
class MpcProblem {
 public:
  static constexpr int kVariables = 36, kRows = 74;
  MpcProblem();
  void build();  ///< for the present state
  qp::Problem view() const { return {H_, g_, A_, lower_, upper_, none_, none_}; }
  void advance(const Eigen::Ref<const Eigen::VectorXd>& x);  ///< 5 ms on with the first jerk

 private:
  using Matrix16 = Eigen::Matrix<double, 16, 16>;
  using Matrix16x3 = Eigen::Matrix<double, 16, 3>;
  void predict(double first_s);

  int tick_ = 0, step_ = 0;
  Eigen::Matrix<double, 2, 3> state_;  // x and y: position, velocity, acceleration
  Eigen::Vector2d foot_{0.0, 0.095};
  Matrix16x3 velocity_of_state_, zmp_of_state_;
  Matrix16 velocity_of_jerk_, zmp_of_jerk_;
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_, lower_, upper_, none_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> A_;
};

}  // namespace mimesis::walker
