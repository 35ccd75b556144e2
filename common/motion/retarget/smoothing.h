#pragma once
#include <span>

#include "common/motion/retarget/posture.h"

namespace mimesis::retarget {

/// E = Σ_t ‖2qₜ − qₜ₋₁ − qₜ₊₁‖² over all but the first and the last posture [M18 3.3.2]; the base's
/// place and orientation count with the joints [rad², m²].
double roughness(std::span<const Posture> postures);

struct SmoothingOptions {
  int sweeps = 30;
  double barrier_weight = 1e-5;  ///< of LimitBarrier against E
};

/// Lowers E by steps along its gradient and the barrier's, projected into the null space of the
/// exact goals' Jacobian, over the whole motion: first and last posture stay, end effectors stay
/// where each posture has them (to 1e-10), joints stay within their limits. `exact[t]`: the goals
/// of posture t, of which only link, frame and what counts is used. A step that does not lower
/// E plus barrier is not taken.
void smooth(robot::Kinematics& kinematics, const std::vector<std::vector<Goal>>& exact,
            std::vector<Posture>& postures, const SmoothingOptions& options = {});

}  // namespace mimesis::retarget
