#pragma once
#include <vector>

#include "hw/sim/body/body_world.h"

namespace mimesis::hw::sim {

/// Speed of a servo by its error [1/s].
inline constexpr double kServoGain_1_s = 200.0;

/// How the motor of a joint follows its set-point, whatever physics moves it: a servo that reaches
/// a speed at once, or a spring to the set-point with a damper beside it. Its own ramp limits the
/// speed.
struct MotorModel {
  bool servo = false;
  double stiffness_n_m_rad = 0.0, damping_n_m_s_rad = 0.0;  ///< of the spring
  double speed_rad_s = 0.0, torque_n_m = 0.0;               ///< most
  double lower_rad = 0.0, upper_rad = 0.0;
};

/// One model per joint, in the order of the joints [docs/walking.md 7.3].
std::vector<MotorModel> motor_models(const robot::Biped& biped, const BodyOptions& options);

}  // namespace mimesis::hw::sim
