#include "nodes/synthesizer/pelvis_velocity.h"

#include <cmath>

namespace mimesis::synthesizer {

constexpr double kLambda = 20.0;  // 1/s

PelvisVelocity::PelvisVelocity(double dt_s) : dt_s_(dt_s), fade_(std::exp(-kLambda * dt_s)) {}

// The deviation e = v − u from a constant u has the solution (e + (ė + λe)t) exp(−λt).
void PelvisVelocity::step(const RootPose& root) {
  const Eigen::Vector3d u(root.velocity_H_m_s.x(), root.velocity_H_m_s.y(), root.yaw_rate_rad_s);
  const Eigen::Vector3d e = value_ - u, a = rate_ + kLambda * e;
  const Eigen::Vector3d next = (e + dt_s_ * a) * fade_;
  rate_ = a * fade_ - kLambda * next;
  value_ = u + next;
}

}  // namespace mimesis::synthesizer
