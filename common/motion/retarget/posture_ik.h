#pragma once
#include <span>

#include "common/robot/kinematics.h"

namespace mimesis::retarget {

/// Where the base of a robot is and what its joints are at.
struct Posture {
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  Eigen::VectorXd q;  ///< dof, [rad] or [m]
};

/// The posture after a step of 6 + dof: shift and turn of the base in W, then the joints (columns
/// as in robot::Jacobian).
Posture advance(const Posture& posture, const Eigen::Ref<const Eigen::VectorXd>& step);
Eigen::VectorXd difference(const Posture& from, const Posture& to);

/// Goal of a frame E that is fixed in a link.
struct Goal {
  int link = 0;
  Eigen::Isometry3d X_LE = Eigen::Isometry3d::Identity();
  Eigen::Isometry3d X_WE = Eigen::Isometry3d::Identity();  ///< where E shall be
  double position_weight = 1.0;     ///< [1/m]; 0: the position does not count
  double orientation_weight = 1.0;  ///< [1/rad]; 0: the orientation does not count
};
Goal goal(int link, const Eigen::Matrix3d& R_WE, const Eigen::Vector3d& p_WE,
          double position_weight, double orientation_weight,
          const Eigen::Vector3d& p_LE = Eigen::Vector3d::Zero());

/// Errors of goals, weighted: position in W, then orientation as the axis-angle vector in W that
/// turns E to its goal. `jacobian`: of the negative error, rows as in `error`.
struct GoalErrors {
  Eigen::VectorXd error;
  Eigen::MatrixXd jacobian;
};
GoalErrors errors(const robot::Kinematics& kinematics, const std::vector<Goal>& goals);

/// Projects steps into the null space of a Jacobian. [M18 3.3.2]
class NullSpace {
 public:
  /// `jacobian` rows×n. Components marked in `locked` (n) stay zero in everything below.
  NullSpace(const Eigen::MatrixXd& jacobian, const std::vector<bool>& locked);

  /// n×(dimension), orthonormal columns.
  const Eigen::MatrixXd& basis() const { return basis_; }
  Eigen::VectorXd project(const Eigen::VectorXd& step) const {
    return basis_ * (basis_.transpose() * step);
  }
  /// The shortest step s with J s = wanted, or closest to it: (JᵀJ + damping I)⁻¹ Jᵀ wanted.
  Eigen::VectorXd reach(const Eigen::VectorXd& wanted, double damping) const;

 private:
  Eigen::MatrixXd jacobian_;  ///< locked columns zero
  Eigen::MatrixXd basis_;
};

/// Keeps joints away from their limits: for the distance d to a limit within `margin` of it, m =
/// margin: b(d) = d/m − 1 − ln(d/m), summed. Smooth, zero further away, infinite at the limit;
/// below m/50 it continues with the slope there.
class LimitBarrier {
 public:
  explicit LimitBarrier(const robot::RobotTree& tree);
  double value(const Eigen::VectorXd& q) const;
  /// First and second derivative, dof each.
  void derivatives(const Eigen::VectorXd& q, Eigen::VectorXd& first, Eigen::VectorXd& second) const;

 private:
  Eigen::VectorXd lower_, upper_, margin_;
};

struct IkResult {
  Posture posture;           ///< within the joint limits
  double exact_error = 0.0;  ///< length of the weighted errors of the exact goals that is left
  int iterations = 0;
};

/// Posture that fulfils `exact` goals as far as the joint limits permit, and among those comes
/// nearest to the `wishes` (least squares) and stays away from the limits: wishes and the barrier's
/// gradient are projected into the null space of the exact goals' Jacobian [M18 3.3.2]. A joint
/// that would leave its limits stops there; the others continue without it. Precondition: `start`
/// within the limits.
IkResult solve(robot::Kinematics& kinematics, const Posture& start, const std::vector<Goal>& exact,
               const std::vector<Goal>& wishes, int max_iterations = 60);

/// E = Σ_t ‖2qₜ − qₜ₋₁ − qₜ₊₁‖² over all but the first and the last posture [M18 3.3.2]; the base's
/// place and orientation count with the joints [rad², m²].
double roughness(std::span<const Posture> postures);

/// Lowers E by steps along its gradient and the barrier's, projected into the null space of the
/// exact goals' Jacobian, over the whole motion: first and last posture stay, end effectors stay
/// where each posture has them (to 1e-10), joints stay within their limits. `exact[t]`: the goals
/// of posture t, of which only link, frame and axes are used. A step that does not lower E plus
/// barrier is not taken.
void smooth(robot::Kinematics& kinematics, const std::vector<std::vector<Goal>>& exact,
            std::vector<Posture>& postures, int sweeps);

}  // namespace mimesis::retarget
