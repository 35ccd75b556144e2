#pragma once
#include "hw/sim/body/dart_body.h"

namespace mimesis::hw::sim {

/// The motors of all joints: how they follow set-points, what they cannot do, how they fail.
class Motors {
 public:
  Motors(const robot::Biped& biped, const DartBody& body, const BodyOptions& options);

  void fail(int joint, MotorFault fault);
  /// Before every step of the world. `set_point`: dof [rad].
  void drive(const Eigen::VectorXd& set_point);
  /// After it: what the joints really bore (JointLoads), dof [N m].
  void feel(const Eigen::VectorXd& torque);

 private:
  struct Motor {
    dart::dynamics::DegreeOfFreedom* dof = nullptr;
    bool servo = false;
    double stiffness_n_m_rad = 0.0, damping_n_m_s_rad = 0.0;
    double speed_rad_s = 0.0, torque_n_m = 0.0;  ///< most
    double lower_rad = 0.0, upper_rad = 0.0;
    double wanted_rad = 0.0;  ///< what the motor's own ramp has come to
    /// What the joint bears beyond its spring's equation (see JointLoads): the torque limit is of
    /// the real torque.
    double beyond_spring_n_m = 0.0;
    double stretch_rad = 0.0;  ///< of the spring, before the step
    bool off = false, locked = false;
  };
  void set_up(Motor& motor);
  void drive(Motor& motor, double set_point);

  double dt_s_;
  std::vector<Motor> motors_;
};

}  // namespace mimesis::hw::sim
