#pragma once
#include <Eigen/Core>

namespace mimesis::synthesizer {

/// A serial arm in the plane: n revolute joints, angles relative to the link before, + counter-
/// clockwise.
struct PlanarArm {
  Eigen::VectorXd length_m;  ///< n

  /// Joint centres and the end, 2×(n+1) [m].
  Eigen::Matrix2Xd points(const Eigen::VectorXd& q_rad) const;
  Eigen::Vector2d end(const Eigen::VectorXd& q_rad) const;
  Eigen::Matrix2Xd jacobian(const Eigen::VectorXd& q_rad) const;  ///< 2×n [m/rad]
};

/// Preferred posture of the arm, where the first task leaves it free.
struct ArmStyle {
  Eigen::VectorXd preferred_rad;  ///< n, only the joints with weight count
  Eigen::VectorXd weight;         ///< n, >= 0
  double gain_1_s = 4.0;
};

/// Prioritised inverse kinematics [M18 3.4.3, fig. 3.22; Nakamura 1987, Siciliano 1991]:
///   q̇ = J⁺(ẋ_d + K(x_d − x)) + (I − J⁺J) · gain · weight∘(q_pref − q),
/// the second task in the null space of the first, so it never disturbs the end effector. Steps by
/// Runge-Kutta 4; K corrects their error. `path` 2×T of the end effector at a period of dt. Returns
/// n×T joint angles, the first of which is q_start (whose end must be at path's begin). @throws
/// ConfigError for sizes that do not fit or a path that begins more than 1e-6 m from the hand.
Eigen::MatrixXd follow(const PlanarArm& arm, const Eigen::VectorXd& q_start,
                       const Eigen::Matrix2Xd& path, double dt_s, const ArmStyle& style);

/// Straight line with the minimum-jerk time course, 2×T.
Eigen::Matrix2Xd straight_reach(const Eigen::Vector2d& from_m, const Eigen::Vector2d& to_m,
                                int samples);

}  // namespace mimesis::synthesizer
