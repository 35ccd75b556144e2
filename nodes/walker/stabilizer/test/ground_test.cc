#include "nodes/walker/stabilizer/ground.h"

#include <gtest/gtest.h>

#include "nodes/walker/stabilizer/test/test_biped.h"

namespace mimesis::walker {
namespace {

struct GroundTest : ::testing::Test {
  robot::Biped biped = test_biped();
  Ground ground{biped, 0.01};
  PatternSample plan = standing();
};

TEST_F(GroundTest, ZmpStaysInTheHullOfBothFeetOrOnTheFootThatCarries) {
  EXPECT_EQ(ground.reachable(plan, {0.05, 0.0}), Eigen::Vector2d(0.05, 0.0));
  EXPECT_LT((ground.reachable(plan, {0.5, 0.0}) - Eigen::Vector2d(0.12, 0.0)).norm(), 1e-12);
  EXPECT_LT((ground.reachable(plan, {0.0, 0.5}) - Eigen::Vector2d(0.0, 0.16)).norm(), 1e-12);
  plan.contact[kLeft] = false;  // inner edge of the right foot
  EXPECT_LT((ground.reachable(plan, {0.0, 0.0}) - Eigen::Vector2d(0.0, -0.049)).norm(), 1e-12);
  plan.contact[kRight] = false;
  EXPECT_EQ(ground.reachable(plan, {0.5, 0.0}), Eigen::Vector2d(0.5, 0.0));
}

TEST_F(GroundTest, ReachFollowsTheHeadingOfTheFoot) {
  plan.contact[kLeft] = false;
  plan.foot[kRight].X_WS.linear() =
      Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_LT((ground.reachable(plan, {0.0, 9.0}) - Eigen::Vector2d(0.0, -0.095 + 0.12)).norm(),
            1e-12);
}

TEST_F(GroundTest, WeightIsSplitByTheLeverBetweenTheAnkles) {
  const auto shares = ground.distribute(plan, {0.03, 0.0475});
  EXPECT_NEAR(shares.left, 0.75, 1e-12);
  for (Side s : robot::kSides) {
    EXPECT_LT((shares.cop_S_m[s] - Eigen::Vector2d(0.03, 0.0)).norm(), 1e-12);
  }
  const auto outside = ground.distribute(plan, {-0.2, 0.12});  // beyond the left ankle
  EXPECT_EQ(outside.left, 1.0);
  EXPECT_LT((outside.cop_S_m[kLeft] - Eigen::Vector2d(-0.09, 0.025)).norm(), 1e-12);
  plan.contact[kLeft] = false;
  const auto single = ground.distribute(plan, {0.02, -0.1});
  EXPECT_EQ(single.left, 0.0);
  EXPECT_LT((single.cop_S_m[kRight] - Eigen::Vector2d(0.02, -0.005)).norm(), 1e-12);
}

TEST_F(GroundTest, CentreOfPressureIsInTheHeadingOfTheFoot) {
  plan.contact[kLeft] = false;
  plan.foot[kRight].X_WS.linear() =
      Eigen::AngleAxisd(M_PI / 2.0, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const auto shares = ground.distribute(plan, {0.03, -0.095 + 0.02});
  EXPECT_LT((shares.cop_S_m[kRight] - Eigen::Vector2d(0.02, -0.03)).norm(), 1e-12);
}

TEST_F(GroundTest, ZmpOfWrenchesIsWhereTheyBalance) {
  std::array<robot::Wrench, 2> wrench;
  wrench[kLeft].force.z() = 100.0;
  wrench[kLeft].moment = Eigen::Vector3d(2.0, -3.0, 0.0);  // at (0.03, 0.02) in S
  wrench[kRight].force.z() = 300.0;
  const auto zmp = measured_zmp(plan, wrench, 100.0);
  ASSERT_TRUE(zmp.has_value());
  EXPECT_NEAR(zmp->x(), 0.25 * 0.03, 1e-12);
  EXPECT_NEAR(zmp->y(), 0.25 * (0.095 + 0.02) - 0.75 * 0.095, 1e-12);
  EXPECT_FALSE(measured_zmp(plan, wrench, 401.0).has_value());
}

}  // namespace
}  // namespace mimesis::walker
