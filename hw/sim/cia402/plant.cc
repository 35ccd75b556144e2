#include "hw/sim/cia402/plant.h"

#include <algorithm>
#include <cmath>

namespace mimesis::hw::sim {
namespace {

constexpr double kLongestStep = 0.5e-3;  // [s]

}  // namespace

void AxisPlant::track(double q_ref, double v_ref, double dt) {
  if (jammed_) return lock();
  const int steps = std::max(1, static_cast<int>(std::ceil(dt / kLongestStep)));
  const double h = dt / steps, w = params_.bandwidth_rad_s;
  for (int i = 1; i <= steps; ++i) {
    const double reference = q_ref - v_ref * (dt - i * h);
    a_ = std::clamp(w * w * (reference - q_) + 2.0 * w * (v_ref - v_), -params_.a_max_rad_s2,
                    params_.a_max_rad_s2);
    v_ = std::clamp(v_ + a_ * h, -params_.v_max_rad_s, params_.v_max_rad_s);
    q_ += v_ * h;
  }
}

void AxisPlant::brake(double deceleration, double dt) {
  const double slowing = std::min(std::abs(v_), deceleration * dt);
  const double v = v_ - std::copysign(slowing, v_);
  const double time = deceleration > 0.0 ? slowing / deceleration : dt;
  a_ = (v - v_) / dt;
  q_ += 0.5 * (v_ + v) * time;
  v_ = v;
}

void AxisPlant::lock() { v_ = a_ = 0.0; }

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
