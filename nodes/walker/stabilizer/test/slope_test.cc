#include "nodes/walker/stabilizer/slope.h"

#include <gtest/gtest.h>

#include "nodes/walker/stabilizer/test/test_biped.h"

namespace mimesis::walker {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kLeastLoad_n = 100.0;

/// Normal of ground that rises by `slope` along x and y.
Vector3d normal(const Vector2d& slope) {
  return Vector3d(-slope.x(), -slope.y(), 1.0).normalized();
}

TEST(GroundPlane, CarriesAFootOntoItself) {
  const GroundPlane ground{.slope = {0.05, -0.02}, .at_W_m = {1.0, 0.0}, .height_m = 0.1};
  FootState foot;
  foot.X_WS.translation() = Vector3d(3.0, 1.0, 0.04);
  foot.X_WS.linear() = math::exp_so3({0.0, 0.0, 0.5});
  foot.v_W = {0.4, 0.2, 0.1};
  ground.carry(foot);
  EXPECT_NEAR(foot.X_WS.translation().z(), 0.04 + 0.1 + 0.05 * 2.0 - 0.02 * 1.0, 1e-12);
  EXPECT_NEAR(foot.v_W.z(), 0.1 + 0.05 * 0.4 - 0.02 * 0.2, 1e-12);
  EXPECT_LT((foot.X_WS.linear().col(2) - normal(ground.slope)).norm(), 1e-12);
  EXPECT_NEAR(math::yaw_of(foot.X_WS.linear()), 0.5, 2e-3);
}

TEST(GroundPlane, LevelGroundChangesNothing) {
  FootState foot;
  foot.X_WS.translation() = Vector3d(3.0, 1.0, 0.04);
  const Eigen::Isometry3d before = foot.X_WS;
  GroundPlane{}.carry(foot);
  EXPECT_EQ(foot.X_WS.matrix(), before.matrix());
}

struct SlopeEstimateTest : ::testing::Test {
  StabilizerSettings settings = [] {
    StabilizerSettings s;
    s.slope = true;
    return s;
  }();
  SlopeEstimate estimate{settings};
  PatternSample plan = standing();
  std::array<double, 2> load{300.0, 300.0};
};

TEST_F(SlopeEstimateTest, FindsTheSlopeOfTheSolesAndTurnsAboutThem) {
  const Vector2d slope(0.05, -0.03);
  plan.foot[kLeft].X_WS.translation().x() = plan.foot[kRight].X_WS.translation().x() = 2.0;
  for (int i = 0; i < 2000; ++i) {
    estimate.step(plan, {normal(slope), normal(slope)}, load, kLeastLoad_n);
  }
  const GroundPlane& ground = estimate.ground();
  EXPECT_LT((ground.slope - slope).norm(), 1e-5);
  EXPECT_NEAR(ground.height({2.0, 0.0}), 0.0, 1e-12) << "where it stands nothing moves";
  EXPECT_NEAR(ground.height({2.3, 0.0}), 0.3 * 0.05, 1e-5);
}

TEST_F(SlopeEstimateTest, HeightGoesOnFromFootToFoot) {
  const Vector2d slope(0.05, 0.0);
  for (int i = 0; i < 2000; ++i) {
    estimate.step(plan, {normal(slope), normal(slope)}, load, kLeastLoad_n);
  }
  const double before = estimate.ground().height({0.3, 0.0});
  for (FootState& foot : plan.foot) foot.X_WS.translation().x() = 0.3;
  estimate.step(plan, {normal(slope), normal(slope)}, load, kLeastLoad_n);
  EXPECT_NEAR(estimate.ground().height({0.3, 0.0}), before, 1e-12);
  EXPECT_NEAR(before, 0.015, 1e-5);
}

TEST_F(SlopeEstimateTest, FeetInTheAirOrHardlyLoadedAreNotAsked) {
  plan.contact[kLeft] = false;
  const Vector3d crooked = normal({0.3, 0.3});
  load[kRight] = 50.0;
  for (int i = 0; i < 200; ++i) estimate.step(plan, {crooked, crooked}, load, kLeastLoad_n);
  EXPECT_TRUE(estimate.ground().slope.isZero(0.0));
  load[kRight] = 600.0;
  for (int i = 0; i < 200; ++i)
    estimate.step(plan, {crooked, Vector3d::UnitZ()}, load, kLeastLoad_n);
  EXPECT_TRUE(estimate.ground().slope.isZero(0.0));
}

TEST_F(SlopeEstimateTest, TurnsSlowlyAndNotBeyondAnyGround) {
  const Vector3d steep = normal({1.0, 0.0});
  estimate.step(plan, {steep, steep}, load, kLeastLoad_n);
  EXPECT_NEAR(estimate.ground().slope.x(), 0.1 * kTick_s, 1e-12);
  for (int i = 0; i < 2000; ++i) estimate.step(plan, {steep, steep}, load, kLeastLoad_n);
  EXPECT_NEAR(estimate.ground().slope.x(), 0.15, 1e-9);
}

}  // namespace
}  // namespace mimesis::walker
