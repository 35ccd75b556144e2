#pragma once
#include <Eigen/Core>

#include "common/motion/mocap/body.h"

namespace mimesis::synthesizer {

/// The non-periodic primitive of the upper body that starts when its target is presented, in any
/// phase of the gait [M18 3.3.3]: a point attractor ẋ = u·x(1 − x) [M18 eq. 3.12], whose solution
/// x = (1 + tanh(u(t − t₀)/2))/2 has a bell-shaped speed, draws one hand from where the other
/// primitives have it to the target: p = p_gait + x (p_target − p_gait).
class ArmReach {
 public:
  /// Draws the hand to the target within duration_s > 0 from now on, or back (`to_target` false).
  void start(bool to_target, double duration_s);
  /// Advances by dt [s]. The solution of eq. 3.12 in closed form: any step is exact.
  void step(double dt_s);

  /// x, scaled so that it is 0 before and 1 after the reach.
  double share() const;
  /// Changes shoulder, elbow and wrist of `angles_rad` so that the finger tips are `share()` of the
  /// way nearer to `p_W_target`; the elbow keeps its side. Returns how far the hand stays away from
  /// where it ought to be [m]: not 0 only if the arm is too short.
  double apply(const mocap::Body& body, mocap::Side side, const Eigen::Vector3d& p_W_pelvis,
               const Eigen::Vector3d& p_W_target, Eigen::Ref<Eigen::VectorXd> angles_rad) const;

 private:
  double x_ = 0.0, u_1_s_ = 0.0;
};

}  // namespace mimesis::synthesizer
