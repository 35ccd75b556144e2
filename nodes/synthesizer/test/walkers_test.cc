#include "nodes/synthesizer/walkers.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "common/math/circle.h"
#include "common/testing/no_malloc.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer {
namespace {
TEST(Walkers, Look) {
  const MotionModel model = testing::walking_model();
  const WalkerStart start;
  Walkers walkers(model, {&start, 1}, {.walk = {.dt_s = 0.005}});
  const auto& r = walkers.repertoire();
  for (const auto& m : r.motions())
    std::printf("step %.3f turn %.4f\n", m.step_length_m, m.turn_rad);
  std::printf("closing %.3f\n", r.style(0).closing_share);
  walkers.walker(0).walk_to({-3.0, 1.0});
  for (int k = 0; k < 4000; ++k) {
    walkers.step();
    const auto& s = walkers.state(0);
    if (k % 40 == 0 || (walkers.walker(0).reached() && k % 40 == 0))
      std::printf(
          "%.2f x %.3f y %.3f psi %.3f z %.3f v %.2f %.2f yaw %.2f phase %.2f stage %d len d %.3f "
          "reached %d piv %.2f\n",
          0.005 * k, s.root.position_W_m.x(), s.root.position_W_m.y(), s.root.heading_rad,
          s.root.height_m, s.root.velocity_H_m_s.x(), s.root.velocity_H_m_s.y(),
          s.root.yaw_rate_rad_s, s.phase_rad, int(walkers.walker(0).stage()),
          walkers.walker(0).goal_distance_m(), walkers.walker(0).reached(),
          walkers.walker(0).pivot_rad_s());
  }
}
}  // namespace
}  // namespace mimesis::synthesizer
