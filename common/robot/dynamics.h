#pragma once
#include <vector>

#include "common/robot/bodies.h"
#include "common/robot/kinematics.h"

namespace mimesis::robot {

/// Motion of a floating robot. Base: origin and axes of the root link B; velocities and
/// accelerations are those of B's origin, expressed in W (classical, not spatial, acceleration).
struct RobotMotion {
  explicit RobotMotion(int dof)
      : q(Eigen::VectorXd::Zero(dof)),
        dq(Eigen::VectorXd::Zero(dof)),
        ddq(Eigen::VectorXd::Zero(dof)) {}
  Eigen::Isometry3d X_WB = Eigen::Isometry3d::Identity();
  Eigen::Vector3d v_W = Eigen::Vector3d::Zero(),
                  omega_W = Eigen::Vector3d::Zero();  ///< [m/s], [rad/s]
  Eigen::Vector3d a_W = Eigen::Vector3d::Zero(), alpha_W = Eigen::Vector3d::Zero();
  Eigen::VectorXd q, dq, ddq;
};

inline constexpr double kGravity = 9.81;  ///< [m/s²], along −z of W

/// Force f and moment about a point p that it is given for.
struct Wrench {
  Eigen::Vector3d force = Eigen::Vector3d::Zero();   ///< [N]
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  ///< [N m]
};

/// Equations of motion of a tree on a floating base: recursive Newton-Euler, CoM
/// Jacobian [Featherstone, Rigid Body Dynamics Algorithms, 2008]. Allocates when it is made, not
/// later. The tree outlives it.
class Dynamics {
 public:
  explicit Dynamics(const RobotTree& tree);

  /// Joint torques and the wrench on the base that cause this motion under gravity. `torque`: dof
  /// [N m] or [N]. @return wrench on the base about the origin of W, in W: the ground must apply
  /// it.
  Wrench inverse_dynamics(const RobotMotion& motion, Eigen::Ref<Eigen::VectorXd> torque);
  /// inverse_dynamics() without joint torques, enough for a zero moment point.
  Wrench ground_wrench(const RobotMotion& motion);
  /// 3 × (6 + dof), columns as robot::Jacobian: velocity of the CoM in W.
  void com_jacobian(const Kinematics& kinematics, Eigen::Ref<Eigen::Matrix3Xd> out) const;

 private:
  /// Motion and force of a body, in its own frame and about its origin; R and p in the parent's.
  struct State {
    Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    Eigen::Vector3d w, alpha, a, force, moment;
  };

  /// Moves body `i` to its joint's position.
  void place(std::size_t i, const RobotMotion& motion);
  void accelerate(const RobotMotion& motion);
  template <bool kTorques>
  Wrench collect(const RobotMotion& motion, double* torque);

  const RobotTree* tree_;
  std::vector<Body> bodies_;
  std::vector<State> state_;
};

/// Zero moment point on the plane z = `ground_z`: (−n_y, n_x)/f_z of the wrench about the origin.
/// Precondition: force.z() > 0.
Eigen::Vector2d zmp_of(const Wrench& ground, double ground_z = 0.0);

}  // namespace mimesis::robot
