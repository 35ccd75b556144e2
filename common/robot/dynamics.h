#pragma once
#include <span>
#include <vector>

#include "common/robot/kinematics.h"
#include "common/robot/robot_tree.h"

namespace mimesis::robot {

/// A link that a joint moves, with all that is fixed to it. Its frame is the link's, turned so that
/// the joint's axis is its z axis: turning by q is then the same few operations for every joint.
struct Body {
  int link = 0;
  int parent = -1;                                     ///< body
  bool slides = false;                                 ///< along z, instead of turning about it
  Eigen::Matrix3d R_PJ = Eigen::Matrix3d::Identity();  ///< at q = 0; P: frame of the parent body
  Eigen::Vector3d p_PJ = Eigen::Vector3d::Zero();      ///< [m]
  double mass = 0.0;                                   ///< [kg]
  Eigen::Vector3d first = Eigen::Vector3d::Zero();     ///< mass · CoM [kg m]
  Eigen::Matrix3d inertia = Eigen::Matrix3d::Zero();   ///< about the frame's origin [kg m²]
  /// mass of the link and of all links it carries [kg]
  double subtree_mass = 0.0;
  Eigen::Vector3d first_L = Eigen::Vector3d::Zero();  ///< mass · CoM in the link's frame [kg m]
  Eigen::Vector3d axis_L = Eigen::Vector3d::UnitZ();  ///< axis of the joint in the link's frame
};

/// The root as body 0, then one a joint: joint d moves body d + 1. Parents come first.
std::vector<Body> bodies_of(const RobotTree& tree);

/// Mass of a part of a robot, say a leg: all that some joints move, with or without the root link.
/// Cheaper than the whole where one part moves alone. No allocation after construction.
class PartMass {
 public:
  /// `dofs`: with every joint all between it and the root.
  PartMass(const RobotTree& tree, std::span<const int> dofs, bool with_root);
  double mass_kg() const { return mass_; }
  /// mass · CoM in the root's frame [kg m]; `q`: joints in the order of `dofs`.
  Eigen::Vector3d first_moment(const Eigen::Ref<const Eigen::VectorXd>& q);

 private:
  std::vector<Body> bodies_;         ///< parent: index here, or −1: the root
  std::vector<Eigen::Index> joint_;  ///< index into q, for every body
  std::vector<Eigen::Vector3d> moment_;
  Eigen::Vector3d root_ = Eigen::Vector3d::Zero();
  double mass_ = 0.0;
};

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
