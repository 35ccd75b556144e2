#pragma once
#include <random>

#include "common/math/so3.h"
#include "common/robot/dynamics.h"

namespace mimesis::robot {

/// A motion of arbitrary posture, velocity and acceleration.
inline RobotMotion random_motion(const RobotTree& tree, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  const auto vector = [&](Eigen::Index n, double size) {
    return Eigen::VectorXd(Eigen::VectorXd::NullaryExpr(n, [&] { return size * unit(random); }));
  };
  RobotMotion m(tree.dof());
  m.q = vector(tree.dof(), 1.5);
  m.dq = vector(tree.dof(), 3.0);
  m.ddq = vector(tree.dof(), 20.0);
  m.X_WB.linear() = math::exp_so3(vector(3, 2.0));
  m.X_WB.translation() = vector(3, 2.0);
  m.v_W = vector(3, 2.0);
  m.omega_W = vector(3, 2.0);
  m.a_W = vector(3, 5.0);
  m.alpha_W = vector(3, 10.0);
  return m;
}

}  // namespace mimesis::robot
