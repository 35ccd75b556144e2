#include "hw/sim/body/motors.h"

#include <algorithm>
#include <dart/dynamics/DegreeOfFreedom.hpp>
#include <dart/dynamics/Joint.hpp>
#include <limits>

namespace mimesis::hw::sim {
namespace {

// Figures of the plants [walking.md 8.3]. The damping is small because DART's contact impulses do
// not know the springs: a strong damper would make loaded joints soft [walking.md 8.2].
constexpr double kStrong_n_m_rad = 6000.0;  ///< legs and trunk
constexpr double kAnkleBush_n_m_rad = 1500.0;
constexpr double kDamping_s = 0.003;  ///< of the stiffness
constexpr double kServoGain_1_s = 200.0;
constexpr double kWeak = 0.2;  ///< of its torque
constexpr double kInfinite = std::numeric_limits<double>::infinity();

/// Between the root and the trunk: bears the upper body.
bool bears_trunk(const robot::Biped& biped, int joint) {
  const auto& tree = biped.tree;
  return tree.carries(tree.moved_link(joint), biped.trunk);
}

bool in_leg(const robot::Biped& biped, int joint) {
  return std::any_of(biped.leg.begin(), biped.leg.end(), [&](const robot::Biped::Leg& leg) {
    return std::find(leg.dof.begin(), leg.dof.end(), joint) != leg.dof.end();
  });
}

bool in_ankle(const robot::Biped& biped, int joint) {
  return std::any_of(biped.leg.begin(), biped.leg.end(), [&](const robot::Biped::Leg& leg) {
    return leg.dof[robot::kAnkleFirst] == joint || leg.dof[robot::kAnkleLast] == joint;
  });
}

bool in_knee(const robot::Biped& biped, int joint) {
  return std::any_of(biped.leg.begin(), biped.leg.end(),
                     [&](const robot::Biped::Leg& leg) { return leg.dof[robot::kKnee] == joint; });
}

/// A URDF that says nothing about a motor does not limit it.
double or_infinite(double limit) { return limit > 0.0 ? limit : kInfinite; }

}  // namespace

Motors::Motors(const robot::Biped& biped, const DartBody& body, const BodyOptions& options)
    : dt_s_(options.dt_s), motors_(body.dof.size()) {
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    const int joint = static_cast<int>(i);
    const robot::Link& link = biped.tree.moved(joint);
    Motor& motor = motors_[i];
    motor.dof = body.dof[i];
    const bool strong = in_leg(biped, joint) || bears_trunk(biped, joint);
    const bool bush = options.plant == Plant::kServo && in_ankle(biped, joint);
    const bool knee = in_knee(biped, joint) && !options.rigid_knees;
    motor.servo = options.plant == Plant::kServo && strong && !bush && !knee;
    motor.stiffness_n_m_rad =
        bush ? kAnkleBush_n_m_rad : (strong ? kStrong_n_m_rad : options.arm_stiffness_n_m_rad);
    motor.damping_n_m_s_rad = kDamping_s * motor.stiffness_n_m_rad;
    motor.speed_rad_s = options.motor_speed_share * or_infinite(link.max_speed);
    motor.torque_n_m = options.motor_torque_share * or_infinite(link.max_effort);
    motor.lower_rad = link.lower;
    motor.upper_rad = link.upper;
    motor.wanted_rad = motor.dof->getPosition();
    set_up(motor);
  }
}

void Motors::set_up(Motor& motor) {
  using dart::dynamics::Joint;
  Joint& joint = *motor.dof->getJoint();
  const bool servo = motor.servo && !motor.off;
  const bool spring = !motor.servo && !motor.off;
  joint.setActuatorType(servo ? Joint::SERVO : Joint::FORCE);
  joint.setLimitEnforcement(true);
  motor.dof->setPositionLimits(motor.lower_rad, motor.upper_rad);
  motor.dof->setVelocityLimits(-kInfinite, kInfinite);  // the ramp of the set-point limits it
  motor.dof->setForceLimits(-motor.torque_n_m, motor.torque_n_m);
  motor.dof->setSpringStiffness(spring ? motor.stiffness_n_m_rad : 0.0);
  motor.dof->setDampingCoefficient(spring ? motor.damping_n_m_s_rad : 0.0);
  motor.dof->setCommand(0.0);
}

void Motors::fail(int joint, MotorFault fault) {
  Motor& motor = motors_[static_cast<std::size_t>(joint)];
  if (fault == MotorFault::kOff) motor.off = true;
  if (fault == MotorFault::kWeak) motor.torque_n_m *= kWeak;
  if (fault == MotorFault::kLocked) {
    motor.locked = true;
    motor.wanted_rad = motor.dof->getPosition();
    motor.torque_n_m = kInfinite;
  }
  set_up(motor);
}

void Motors::drive(Motor& motor, double set_point) {
  if (motor.off) return;
  const double most = motor.speed_rad_s * dt_s_;
  if (!motor.locked) {
    motor.wanted_rad = std::clamp(set_point, motor.wanted_rad - most, motor.wanted_rad + most);
  }
  const double q = motor.dof->getPosition();
  if (motor.servo) {
    motor.dof->setCommand(
        std::clamp(kServoGain_1_s * (motor.wanted_rad - q), -motor.speed_rad_s, motor.speed_rad_s));
    return;
  }
  const double most_rad = motor.torque_n_m / motor.stiffness_n_m_rad;
  const double beyond_rad = motor.beyond_spring_n_m / motor.stiffness_n_m_rad;
  motor.stretch_rad =
      std::clamp(motor.wanted_rad - q, -most_rad - beyond_rad, most_rad - beyond_rad);
  motor.dof->setRestPosition(q + motor.stretch_rad);
}

void Motors::drive(const Eigen::VectorXd& set_point) {
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    drive(motors_[i], set_point[static_cast<Eigen::Index>(i)]);
  }
}

void Motors::feel(const Eigen::VectorXd& torque) {
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    Motor& motor = motors_[i];
    if (motor.servo || motor.off) continue;
    motor.beyond_spring_n_m =
        torque[static_cast<Eigen::Index>(i)] - motor.stiffness_n_m_rad * motor.stretch_rad;
  }
}

}  // namespace mimesis::hw::sim
