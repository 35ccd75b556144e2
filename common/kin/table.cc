#include "common/kin/table.h"

#include <cmath>

#include "common/error.h"

namespace mimesis::kin {
namespace {

/// Adds balls from `from` to `to`, both ends included if `ends`.
void add_row(const Eigen::Vector3d& from, const Eigen::Vector3d& to, bool ends,
             const BarShape& shape, std::vector<Ball>& balls) {
  const int steps = static_cast<int>(std::ceil((to - from).norm() / shape.max_spacing - 1e-9));
  for (int i = ends ? 0 : 1; i <= (ends ? steps : steps - 1); ++i) {
    balls.push_back({from + (to - from) * i / std::max(steps, 1), shape.ball_radius});
  }
}

}  // namespace

Eigen::Vector3d bar_center(const BarShape& shape) {
  return {shape.x, 0.0, shape.surface_z + shape.height + shape.ball_radius};
}

std::vector<Ball> bar_balls(const BarShape& shape) {
  MIMESIS_ASSERT(shape.max_spacing > 0.0 && shape.height >= shape.ball_radius);
  const Eigen::Vector3d side(0.0, shape.half_width, 0.0);
  const Eigen::Vector3d bar = bar_center(shape);
  const Eigen::Vector3d foot(shape.x, 0.0, shape.surface_z + shape.ball_radius);
  std::vector<Ball> balls;
  add_row(foot - side, bar - side, true, shape, balls);
  add_row(foot + side, bar + side, true, shape, balls);
  add_row(bar - side, bar + side, false, shape, balls);
  return balls;
}

}  // namespace mimesis::kin
