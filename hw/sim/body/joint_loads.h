#pragma once
#include <Eigen/Core>

#include "hw/sim/body/contacts.h"

namespace mimesis::hw::sim {

/// A force on a link, beside the ground's.
struct LinkForce {
  int link;
  Eigen::Vector3d point_L_m, force_W_n;
};

/// What the joints really bear in a step of the world: inverse dynamics of the motion that came
/// out. DART's spring equation is no measure of it, as contact impulses come on top of the step
/// that the springs have seen [walking.md 8.2].
class JointLoads {
 public:
  /// `payload_kg`: in the trunk, at its centre; the biped does not know of it. The biped outlives
  /// this.
  JointLoads(const robot::Biped& biped, double payload_kg, double dt_s);

  /// Before the step of the world.
  void before(const DartBody& body);
  /// After it. Torque of motors and end stops on their links, dof [N m], mean of the step.
  const Eigen::VectorXd& after(const DartBody& body, const GroundContact& ground,
                               const std::array<Eigen::Isometry3d, 2>& X_WS,
                               const std::vector<LinkForce>& forces);

 private:
  void take_off(int link, const Eigen::Vector3d& p_W_m, const Eigen::Vector3d& force_W,
                const Eigen::Vector3d& moment_W);

  const robot::Biped* biped_;
  robot::RobotTree loaded_;  ///< with the payload
  double dt_s_;
  robot::Kinematics kinematics_;
  robot::Dynamics dynamics_;
  robot::RobotMotion motion_;
  Eigen::Vector3d v_B_ = Eigen::Vector3d::Zero(), omega_B_ = Eigen::Vector3d::Zero();
  robot::Jacobian jacobian_;
  Eigen::VectorXd torque_;
};

}  // namespace mimesis::hw::sim
