#pragma once
#include "common/robot/dynamics.h"
#include "common/robot/kinematics.h"

namespace mimesis::robot {

/// Momenta of the whole robot.
struct Momentum {
  Eigen::Vector3d com_W_m, linear_W, angular_W;  ///< [m], [kg m/s], [kg m²/s] about the CoM
};

/// Momenta by the links' Jacobians.
inline Momentum momentum(const RobotTree& tree, const RobotMotion& m) {
  Kinematics kinematics(tree);
  kinematics.update(m.X_WB, m.q);
  Eigen::VectorXd nu(6 + tree.dof());
  nu << m.v_W, m.omega_W, m.dq;
  Jacobian J(6, 6 + tree.dof());
  Momentum sum{.com_W_m = kinematics.com(),
               .linear_W = Eigen::Vector3d::Zero(),
               .angular_W = Eigen::Vector3d::Zero()};
  for (std::size_t l = 0; l < tree.links().size(); ++l) {
    const Inertia& inertia = tree.links()[l].inertia;
    const Eigen::Isometry3d& X = kinematics.X_WL(static_cast<int>(l));
    const Eigen::Vector3d com = X * inertia.com_m;
    kinematics.jacobian(static_cast<int>(l), com, J);
    const Eigen::Matrix<double, 6, 1> v = J * nu;
    const Eigen::Vector3d p = inertia.mass_kg * v.head<3>();
    sum.linear_W += p;
    sum.angular_W += X.linear() * inertia.about_com_kg_m2 * X.linear().transpose() * v.tail<3>() +
                     (com - sum.com_W_m).cross(p);
  }
  return sum;
}

}  // namespace mimesis::robot
