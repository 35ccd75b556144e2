#include "nodes/synthesizer/dynamics/root_motion.h"

#include <gtest/gtest.h>

#include "common/math/circle.h"
#include "nodes/synthesizer/dynamics/character_batch.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer {
namespace {

using testing::walking_model, testing::WalkSettings;

TEST(RootMotion, AWalkerMovesAtTheSpeedItWasMadeFor) {
  for (const double speed : {1.0, -0.6}) {
    const WalkSettings settings{.speed_m_s = speed};
    CharacterBatch batch(walking_model(settings), 1, {.dt_s = 1.0 / 100.0});
    for (int n = 0; n < 500; ++n) batch.step();
    const RootPose root = batch.root(0);
    EXPECT_NEAR(root.position_W_m.x(), 5.0 * speed, 0.05) << speed;
    EXPECT_NEAR(root.position_W_m.y(), 0.0, 0.02);
    EXPECT_NEAR(root.heading_rad, 0.0, 0.01);
    EXPECT_NEAR(root.height_m, 0.87, 0.005);
  }
}

TEST(RootMotion, ATurningWalkerTurns) {
  const WalkSettings settings{.speed_m_s = 0.8, .turn_rad_s = 0.5};
  CharacterBatch batch(walking_model(settings), 1, {.dt_s = 1.0 / 100.0});
  for (int n = 0; n < 400; ++n) batch.step();
  const RootPose root = batch.root(0);
  EXPECT_NEAR(root.heading_rad, 2.0, 0.02);
  const double radius = 0.8 / 0.5;  // on a circle to the left
  EXPECT_NEAR(root.position_W_m.x(), radius * std::sin(2.0), 0.05);
  EXPECT_NEAR(root.position_W_m.y(), radius * (1.0 - std::cos(2.0)), 0.05);
}

TEST(RootMotion, TheSupportingPointRestsInTheWorld) {  // whatever the figure does
  CharacterBatch batch(testing::random_model(2), 1, {.dt_s = 1.0 / 200.0});
  batch.set_root(0, {2.0, 1.0}, 0.7);
  batch.step();
  int checked = 0, supports[2] = {0, 0};
  for (int n = 0; n < 2000; ++n) {
    const Eigen::Vector3d heel[2] = {batch.heel_W_m(0, 0), batch.heel_W_m(0, 1)};
    const Eigen::Vector3d toe[2] = {batch.toe_W_m(0, 0), batch.toe_W_m(0, 1)};
    batch.step();
    const int side = batch.root(0).support;
    const Eigen::Vector3d heel_now = batch.heel_W_m(0, side), toe_now = batch.toe_W_m(0, side);
    ++supports[side];
    if (std::abs(heel_now.z() - toe_now.z()) < 0.021) continue;  // both carry
    const bool on_heel = heel_now.z() < toe_now.z();
    const Eigen::Vector3d moved = on_heel ? heel_now - heel[side] : toe_now - toe[side];
    ASSERT_LT(moved.head<2>().norm(), 2e-6) << n;
    ++checked;
  }
  EXPECT_GT(checked, 500);
  EXPECT_GT(std::min(supports[0], supports[1]), 100);
}

}  // namespace
}  // namespace mimesis::synthesizer
