#include "hw/sim/drives/world_joint.h"

#include <algorithm>
#include <cmath>

namespace mimesis::hw::sim {

void WorldJoint::track(double q_ref, double v_ref, double) {
  if (jammed_) return lock();
  motor_ = q_ref;
  rate_ = v_ref;
}

void WorldJoint::brake(double deceleration, double dt) {
  const double slowing = std::min(std::abs(rate_), deceleration * dt);
  const double rate = rate_ - std::copysign(slowing, rate_);
  const double time = deceleration > 0.0 ? slowing / deceleration : dt;
  motor_ += 0.5 * (rate_ + rate) * time;
  rate_ = rate;
}

void WorldJoint::measure(double position_rad, double velocity_rad_s, double torque_n_m) {
  position_ = position_rad;
  velocity_ = velocity_rad_s;
  torque_ = torque_n_m;
}

}  // namespace mimesis::hw::sim
