#include "hw/sim/body/body_world.h"

#include <gtest/gtest.h>

#include "hw/sim/body/test/bodies.h"

namespace mimesis::hw::sim {
namespace {

class Plants : public testing::TestWithParam<Plant> {};
INSTANTIATE_TEST_SUITE_P(BodyWorld, Plants, testing::Values(Plant::kSprings, Plant::kServo));

TEST_P(Plants, StandStill) {
  const TestRobot body = test_robot();
  BodyWorld world(body.biped, body.urdf, {.plant = GetParam()});
  const Eigen::Vector3d start = world.truth().com_W_m;
  for (int i = 0; i < 600; ++i) world.step(body.half_sitting(), 0.005);
  const BodyTruth& truth = world.truth();
  EXPECT_NEAR(truth.time_s, 3.0, 1e-12);
  EXPECT_NEAR(truth.normal_n[0] + truth.normal_n[1], body.weight_n(), 1e-3 * body.weight_n());
  EXPECT_LT((truth.com_W_m - start).norm(), 0.002);
  EXPECT_FALSE(truth.fell) << truth.how;
}

}  // namespace
}  // namespace mimesis::hw::sim
