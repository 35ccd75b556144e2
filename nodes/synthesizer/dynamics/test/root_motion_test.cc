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

}  // namespace
}  // namespace mimesis::synthesizer
