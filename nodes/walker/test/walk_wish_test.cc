#include "nodes/walker/walk_wish.h"

#include <gtest/gtest.h>

#include <numbers>

#include "nodes/walker/test/closed_loop.h"

namespace mimesis::walker {
namespace {

constexpr double kPi = std::numbers::pi;

using testing::biped;

class WalkWishTest : public ::testing::Test {
 protected:
  const WalkerWish& step(const MotionWish* m) { return wish.step(m, robot, kTick_s); }
  /// Half-sitting, but joint `name` at `rad`.
  Eigen::VectorXd upper_body(std::string_view name, double rad) const {
    Eigen::VectorXd all = biped().half_sitting;
    all[biped().tree.require_joint(name)] = rad;
    return all(biped().upper_body);
  }

  GaitSettings gait{};
  WalkWishSettings settings{};
  WalkWish wish{biped(), gait, settings};
  GroundPose robot{};
  MotionWish motion{};
};

TEST_F(WalkWishTest, NobodyWishesAnything) {
  const WalkerWish& w = step(nullptr);
  EXPECT_FALSE(w.walk.walk);
  EXPECT_EQ(w.walk.velocity_m_s.norm(), 0.0);
  EXPECT_EQ(w.hand[kLeft].share, 0.0);
  EXPECT_TRUE(w.upper_body.isApprox(Eigen::VectorXd(biped().half_sitting(biped().upper_body))));
}

TEST_F(WalkWishTest, PassesWhatTheRobotCan) {
  motion.velocity_m_s = {0.2, -0.05};
  motion.yaw_rate_rad_s = 0.1;
  const WalkerWish& w = step(&motion);
  EXPECT_TRUE(w.walk.walk);
  EXPECT_EQ(w.walk.velocity_m_s, motion.velocity_m_s);
  EXPECT_EQ(w.walk.yaw_rate_rad_s, 0.1);
  EXPECT_EQ(wish.clipped(), "");
}

TEST_F(WalkWishTest, SaysWhichVelocitiesTheRobotCannotAndLeavesThemToThePattern) {
  motion.velocity_m_s = {1.06, -0.4};
  motion.yaw_rate_rad_s = -0.9;
  const WalkerWish& w = step(&motion);
  EXPECT_EQ(w.walk.velocity_m_s, motion.velocity_m_s);
  EXPECT_EQ(w.walk.yaw_rate_rad_s, motion.yaw_rate_rad_s);
  EXPECT_EQ(wish.clipped(), "velocity forward [m/s]: 1.06 is wished, the robot can 0.35");
  motion.velocity_m_s.x() = 0.1;
  step(&motion);
  EXPECT_EQ(wish.clipped(), "velocity to the left [m/s]: -0.4 is wished, the robot can 0.15");
}

TEST_F(WalkWishTest, StandsForAMotionThatStandsOrHardlyMoves) {
  motion.velocity_m_s = {0.2, 0.0};
  motion.stands = true;
  EXPECT_FALSE(step(&motion).walk.walk);
  motion.stands = false;
  motion.velocity_m_s = {0.005, 0.005};
  motion.pelvis_W_m = {1.0, 0.0};  // far off: no reason to walk
  EXPECT_FALSE(step(&motion).walk.walk);
  EXPECT_EQ(step(&motion).walk.velocity_m_s.norm(), 0.0);
  motion.yaw_rate_rad_s = 0.1;
  EXPECT_TRUE(step(&motion).walk.walk);
}

TEST_F(WalkWishTest, ComesBackToWhereTheMotionIs) {
  motion.velocity_m_s = {0.2, 0.0};
  robot.yaw_rad = 0.5 * kPi;
  motion.heading_rad = robot.yaw_rad + 0.1;
  motion.pelvis_W_m = {-0.1, 0.05};  // 5 cm ahead, 10 cm to the left of a robot that looks along y
  const WalkerWish& w = step(&motion);
  EXPECT_NEAR(w.walk.velocity_m_s.x(), 0.2 + 0.3 * 0.05, 1e-12);
  EXPECT_NEAR(w.walk.velocity_m_s.y(), 0.3 * 0.1, 1e-12);
  EXPECT_NEAR(w.walk.yaw_rate_rad_s, 0.3 * 0.1, 1e-12);
  motion.pelvis_W_m = {3.0, 50.0};
  motion.heading_rad = robot.yaw_rad - 3.0;
  step(&motion);
  EXPECT_NEAR(w.walk.velocity_m_s.x(), 0.24, 1e-12);  // bounded
  EXPECT_NEAR(w.walk.velocity_m_s.y(), -0.04, 1e-12);
  EXPECT_NEAR(w.walk.yaw_rate_rad_s, -0.05, 1e-12);
  motion.velocity_m_s.x() = 0.34;
  EXPECT_NEAR(step(&motion).walk.velocity_m_s.x(), 0.38, 1e-12);
  EXPECT_EQ(wish.clipped(), "");  // no wish is beyond the limits
}

TEST_F(WalkWishTest, FootprintsAreWalkedAsTheyAre) {
  motion.velocity_m_s = {0.0, 0.0};
  motion.landing[0] = Footprint{.side = kRight, .p_W_m = {0.2, -0.1}, .yaw_rad = 0.1};
  motion.pelvis_W_m = {3.0, 0.0};
  const WalkerWish& w = step(&motion);
  EXPECT_TRUE(w.walk.walk);
  ASSERT_TRUE(w.walk.landing[0].has_value());
  EXPECT_EQ(w.walk.landing[0]->side, kRight);
  EXPECT_EQ(w.walk.landing[0]->p_W_m.x(), 0.2);
  EXPECT_EQ(w.walk.velocity_m_s.norm(), 0.0);  // no correction
  EXPECT_FALSE(step(nullptr).walk.landing[0].has_value());
}

TEST_F(WalkWishTest, TheUpperBodyFadesInAndOutWithoutAJump) {
  motion.upper_body = upper_body("left_shoulder_pitch", 1.0);
  Eigen::VectorXd last = step(nullptr).upper_body;
  const Eigen::VectorXd rest = last;
  const auto run = [&](const MotionWish* m, int ticks) {
    double fastest = 0.0;
    for (int i = 0; i < ticks; ++i) {
      const WalkerWish& w = step(m);
      EXPECT_LT(((w.upper_body - last) / kTick_s - w.upper_body_rate).norm(), 0.02);
      fastest = std::max(fastest, w.upper_body_rate.cwiseAbs().maxCoeff());
      last = w.upper_body;
    }
    return fastest;
  };
  const double way = (motion.upper_body - rest).cwiseAbs().maxCoeff();
  EXPECT_NEAR(run(&motion, 200), 1.875 * way, 0.01);  // minimum jerk in 1 s
  EXPECT_TRUE(last.isApprox(motion.upper_body, 1e-9));
  EXPECT_NEAR(run(nullptr, 200), 1.875 * way, 0.01);
  EXPECT_TRUE(last.isApprox(rest, 1e-9));
  EXPECT_EQ(wish.clipped(), "");
}

TEST_F(WalkWishTest, TheUpperBodyKeepsTheJointsLimits) {
  motion.upper_body = upper_body("left_elbow", 9.0);
  motion.upper_body_rate = Eigen::VectorXd::Constant(motion.upper_body.size(), 0.25);
  const int elbow = biped().tree.require_joint("left_elbow");
  const auto i = std::ranges::find(biped().upper_body, elbow) - biped().upper_body.begin();
  for (int t = 0; t < 400; ++t) {
    step(&motion);
    EXPECT_EQ(wish.clipped().substr(0, 10), "left_elbow");
  }
  const WalkerWish& w = step(&motion);
  EXPECT_NEAR(w.upper_body[i], biped().tree.upper()[elbow], 1e-12);
  EXPECT_EQ(w.upper_body_rate[i], 0.25);
}

TEST_F(WalkWishTest, HandsHaveSharesBetweenNoneAndAll) {
  motion.hand[kRight] = {.p_W_m = {0.4, -0.2, 0.9}, .share = 1.7};
  motion.hand[kLeft] = {.p_W_m = {0.4, 0.2, 0.9}, .share = -1.0};
  const WalkerWish& w = step(&motion);
  EXPECT_EQ(w.hand[kRight].share, 1.0);
  EXPECT_EQ(w.hand[kRight].p_W_m.z(), 0.9);
  EXPECT_EQ(w.hand[kLeft].share, 0.0);
}

}  // namespace
}  // namespace mimesis::walker
