#include "nodes/planner/ball_gaps.h"

#include <cmath>
#include <cstdint>

#include "common/math/vector_clones.h"

namespace mimesis::planner {
namespace {

// Flags as wide as the numbers they come from: the loops stay in vector registers.
std::int64_t flag(bool condition) { return condition ? -1 : 0; }

}  // namespace

MIMESIS_VECTOR_CLONES
Gaps ball_gaps(const BallArrays& balls, const double* bound, const kin::Ball& obstacle) {
  const double *x = balls.x, *y = balls.y, *z = balls.z, *reach = balls.reach;
  const double cx = obstacle.center.x(), cy = obstacle.center.y(), cz = obstacle.center.z();
  const double r = obstacle.radius;
  std::int64_t touches = 0, within = 0;
  for (std::size_t i = 0; i < balls.n; ++i) {
    const double dx = x[i] - cx, dy = y[i] - cy, dz = z[i] - cz, s = reach[i] + r, w = s + bound[i];
    const double squared = dx * dx + dy * dy + dz * dz;
    touches |= flag(squared < s * s);
    within |= flag(squared < w * w);
  }
  return {touches != 0, within != 0};
}

MIMESIS_VECTOR_CLONES
Gaps box_gaps(const BallArrays& balls, const double* bound, const kin::Box& obstacle) {
  const double *x = balls.x, *y = balls.y, *z = balls.z, *reach = balls.reach;
  const double cx = obstacle.center.x(), cy = obstacle.center.y(), cz = obstacle.center.z();
  const double hx = obstacle.half_extent.x(), hy = obstacle.half_extent.y(),
               hz = obstacle.half_extent.z();
  std::int64_t touches = 0, within = 0;
  for (std::size_t i = 0; i < balls.n; ++i) {
    double dx = std::abs(x[i] - cx) - hx, dy = std::abs(y[i] - cy) - hy,
           dz = std::abs(z[i] - cz) - hz;
    dx = dx > 0.0 ? dx : 0.0;
    dy = dy > 0.0 ? dy : 0.0;
    dz = dz > 0.0 ? dz : 0.0;
    const double squared = dx * dx + dy * dy + dz * dz, s = reach[i], w = s + bound[i];
    touches |= flag(squared < s * s);
    within |= flag(squared < w * w);
  }
  return {touches != 0, within != 0};
}

MIMESIS_VECTOR_CLONES
void add_joint_motion(const BallArrays& balls, const double* moved, const double* o,
                      const double* u, double delta, const double* outer, double* inner) {
  const double *x = balls.x, *y = balls.y, *z = balls.z;
  for (std::size_t i = 0; i < balls.n; ++i) {
    const double dx = x[i] - o[0], dy = y[i] - o[1], dz = z[i] - o[2];
    const double along = dx * u[0] + dy * u[1] + dz * u[2];
    const double squared = dx * dx + dy * dy + dz * dz - along * along;
    const double rho = std::sqrt(squared > 0.0 ? squared : 0.0);
    inner[i] = outer[i] + moved[i] * (rho + outer[i]) * delta;
  }
}

}  // namespace mimesis::planner
