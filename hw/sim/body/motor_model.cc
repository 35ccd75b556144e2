#include "hw/sim/body/motor_model.h"

#include <algorithm>
#include <limits>

namespace mimesis::hw::sim {
namespace {

// Figures of the plants [docs/walking.md 7.3]. The damping is small because DART's contact impulses
// do not know the springs: a strong damper would make loaded joints soft [docs/walking.md 7.2].
constexpr double kStrong_n_m_rad = 6000.0;  ///< legs and trunk
constexpr double kAnkleBush_n_m_rad = 1500.0;
constexpr double kDamping_s = 0.003;  ///< share of the stiffness

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
double or_infinite(double limit) {
  return limit > 0.0 ? limit : std::numeric_limits<double>::infinity();
}

}  // namespace

std::vector<MotorModel> motor_models(const robot::Biped& biped, const BodyOptions& options) {
  std::vector<MotorModel> motors(static_cast<std::size_t>(biped.tree.dof()));
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const int joint = static_cast<int>(i);
    const robot::Link& link = biped.tree.moved(joint);
    MotorModel& motor = motors[i];
    const bool strong = in_leg(biped, joint) || bears_trunk(biped, joint);
    const bool bush = options.plant == Plant::servo && in_ankle(biped, joint);
    const bool knee = in_knee(biped, joint) && !options.rigid_knees;
    motor.servo = options.plant == Plant::servo && strong && !bush && !knee;
    motor.stiffness_n_m_rad =
        bush ? kAnkleBush_n_m_rad : (strong ? kStrong_n_m_rad : options.arm_stiffness_n_m_rad);
    motor.damping_n_m_s_rad = kDamping_s * motor.stiffness_n_m_rad;
    motor.speed_rad_s = options.motor_speed_share * or_infinite(link.max_speed);
    motor.torque_n_m = options.motor_torque_share * or_infinite(link.max_effort);
    motor.lower_rad = link.lower;
    motor.upper_rad = link.upper;
  }
  return motors;
}

}  // namespace mimesis::hw::sim
