#pragma once
#include <cstddef>

#include "common/kin/table.h"

namespace mimesis::planner {

/// n balls as arrays: centres [m] and the distance from an obstacle's surface at which they touch
/// it [m].
struct BallArrays {
  const double* x;
  const double* y;
  const double* z;
  const double* reach;
  std::size_t n;
};

/// Any of the balls touches, or is within bound[i] of touching.
struct Gaps {
  bool touches = false;
  bool within_bound = false;
};

/// The inner loops of collision checking; compiled with -O3, for the processor at hand.
Gaps ball_gaps(const BallArrays& balls, const double* bound, const kin::Ball& obstacle);
Gaps box_gaps(const BallArrays& balls, const double* bound, const kin::Box& obstacle);

/// ρ of every ball from the axis through o along the unit vector u, then inner[i] = outer[i] +
/// (ρ + outer[i]) δ: one joint of the recursion in collision.h. `moved[i]` is 0 for balls the joint
/// does not move, else 1.
void add_joint_motion(const BallArrays& balls, const double* moved, const double* o,
                      const double* u, double delta, const double* outer, double* inner);

}  // namespace mimesis::planner
