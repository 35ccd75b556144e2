#pragma once
#include "common/motion/retarget/posture.h"

namespace mimesis::retarget {

struct IkOptions {
  int max_iterations = 60;
  double exact_tolerance = 1e-9;  ///< of the weighted errors of the exact goals
  double still = 1e-5;            ///< ends when no component of a step is larger [m, rad]
  double barrier_weight = 2e-3;   ///< of LimitBarrier against the squared errors of wishes
  /// Against change from the start, per squared radian or metre: decides what goals leave open,
  /// such as which of two aligned joints turns.
  double stay_weight = 1e-3;
};

struct IkResult {
  Posture posture;           ///< within the joint limits
  double exact_error = 0.0;  ///< length of the weighted errors of the exact goals that is left
  int iterations = 0;
};

/// Posture that fulfils `exact` goals as far as the joint limits permit, and among those comes
/// nearest to the `wishes` (least squares) and stays away from the limits: wishes and the barrier's
/// gradient are projected into the null space of the exact goals' Jacobian [M18 3.3.2]. A joint
/// that would leave its limits stops there and the others go on without it.
/// Precondition: `start` within the limits.
IkResult solve(robot::Kinematics& kinematics, const Posture& start, const std::vector<Goal>& exact,
               const std::vector<Goal>& wishes, const IkOptions& options = {});

}  // namespace mimesis::retarget
