#pragma once
#include <Eigen/Core>

#include "nodes/synthesizer/dynamics/character_batch.h"

namespace mimesis::synthesizer {

/// The pelvis' velocity as a walking robot can follow it. What the standing foot makes of it has
/// ripples, of the roll from heel to toe and of changes of support; this is that through a
/// critically damped low-pass, v̈ = λ²(u − v) − 2λv̇ with λ = 20 1/s: 0.1 s behind, an oscillation of
/// ω reduced by 1/(1 + (ω/λ)²).
class PelvisVelocity {
 public:
  explicit PelvisVelocity(double dt_s);
  void step(const RootPose& root);

  /// Forward and left in the heading frame [m/s], turn to the left [rad/s].
  const Eigen::Vector3d& value() const { return value_; }

 private:
  double dt_s_, fade_;
  Eigen::Vector3d value_ = Eigen::Vector3d::Zero(), rate_ = Eigen::Vector3d::Zero();
};

}  // namespace mimesis::synthesizer
