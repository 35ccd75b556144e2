#pragma once
#include <Eigen/Core>

#include "hw/sim/body/body_world.h"

namespace dart::dynamics {
class BodyNode;
class DegreeOfFreedom;
class Skeleton;
}  // namespace dart::dynamics
namespace dart::simulation {
class World;
}
namespace mimesis::hw::sim {

/// Where DART keeps a link: frames that weigh nothing hang on the body that carries them.
struct DartLink {
  dart::dynamics::BodyNode* node = nullptr;
  Eigen::Isometry3d X_NL = Eigen::Isometry3d::Identity();
};

/// A biped and the ground in DART. Private to BodyWorld.
struct DartBody {
  std::shared_ptr<dart::simulation::World> world;
  std::shared_ptr<dart::dynamics::Skeleton> robot;
  std::vector<dart::dynamics::DegreeOfFreedom*> dof;   ///< in the order of RobotTree
  std::vector<DartLink> link;                          ///< in the order of RobotTree
  Eigen::Matrix3d R_WG = Eigen::Matrix3d::Identity();  ///< z of the ground is its normal

  const DartLink& at(int index) const { return link[static_cast<std::size_t>(index)]; }
  Eigen::Isometry3d X_WL(int index) const;
  /// Velocity of the link's origin, in W.
  Eigen::Vector3d velocity(int index) const;
  Eigen::Isometry3d X_WB() const;
};

/// Robot, ground and plates, the robot standing half-sitting. Precondition: every link that moves
/// has a mass, fixed ones have none. @throws ConfigError if a plate has no size
DartBody make_dart_body(const robot::Biped& biped, const BodyOptions& options);

/// Forces of the ground on the soles in one step of the world.
struct GroundContact {
  std::array<robot::Wrench, 2> foot_S;                   ///< about the sole's origin, in S
  Eigen::Vector2d weighted_W = Eigen::Vector2d::Zero();  ///< sum of p·f_z over the contacts
  double vertical_n = 0.0;                               ///< sum of f_z
};

/// A link bears this beside its own mass from now on.
void carry(DartBody& body, int link, const robot::Inertia& load);

/// Reads the contacts of the last step. `X_WS`: soles before that step, at which DART computed
/// them.
GroundContact read_contacts(const DartBody& body, const robot::Biped& biped,
                            const std::array<Eigen::Isometry3d, 2>& X_WS);

/// A force on a link, beside the ground's.
struct LinkForce {
  int link;
  Eigen::Vector3d point_L_m, force_W_n;
};

/// A contact's force on a link.
struct ContactForce {
  int link;
  Eigen::Vector3d p_W_m, force_W_n;
};

/// True loads of the joints in a step of the world: inverse dynamics of the resulting motion.
/// DART's spring equation does not measure them, because contact impulses are added after the step
/// that the springs have seen [docs/walking.md 7.2].
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
                               const std::vector<LinkForce>& forces,
                               const std::vector<ContactForce>& contacts);
  /// A link bears this beside its own mass from now on.
  void carry(int link, const robot::Inertia& load);

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

/// The motors of all joints: how they follow set-points, their limits and failures.
class Motors {
 public:
  Motors(const robot::Biped& biped, const DartBody& body, const BodyOptions& options);

  void fail(int joint, MotorFault fault);
  /// Before every step of the world. `set_point`: dof [rad].
  void drive(const Eigen::VectorXd& set_point);
  /// After it: the true loads of the joints (JointLoads), dof [N m].
  void feel(const Eigen::VectorXd& torque);
  /// Where the motor's own encoder is, before the spring [rad], [rad/s]; behind it on rigid joints.
  double position(std::size_t joint) const;
  double speed(std::size_t joint) const;

 private:
  struct Motor {
    dart::dynamics::DegreeOfFreedom* dof = nullptr;
    bool servo = false;
    double stiffness_n_m_rad = 0.0, damping_n_m_s_rad = 0.0;
    double speed_rad_s = 0.0, torque_n_m = 0.0;  ///< most
    double lower_rad = 0.0, upper_rad = 0.0;
    double wanted_rad = 0.0;  ///< set-point that the motor's own ramp has reached
    /// Load of the joint beyond its spring's equation (see JointLoads): the torque limit applies to
    /// the real torque.
    double beyond_spring_n_m = 0.0;
    double stretch_rad = 0.0;  ///< stretch of the spring, before the step
    /// Where the motor is, and was a step ago: its load may have turned it back.
    double at_rad = 0.0, before_rad = 0.0;
    bool off = false, locked = false;
  };
  void set_up(Motor& motor);
  void drive(Motor& motor, double set_point);

  double dt_s_;
  std::vector<Motor> motors_;
};

}  // namespace mimesis::hw::sim
