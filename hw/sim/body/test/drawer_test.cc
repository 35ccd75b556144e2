#include "hw/sim/body/drawer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "hw/sim/body/test/bodies.h"

namespace mimesis::hw::sim {
namespace {

using Eigen::Vector3d;

const Vector3d kFar(0.0, 0.0, 1.0);

/// A drawer with its front at x = 1 and hands that are moved by hand.
class DrawerTest : public ::testing::Test {
 protected:
  void make(const DrawerSettings& settings) { drawer_ = std::make_unique<Drawer>(settings); }
  /// The hands go to their places with constant speed in this number of ticks.
  Vector3d move(const Vector3d& left, const Vector3d& right, int ticks) {
    const std::array from = hands_.p_W_m;
    Vector3d force = Vector3d::Zero();
    for (int i = 1; i <= ticks; ++i) {
      const double share = static_cast<double>(i) / ticks;
      hands_.p_W_m = {from[0] + share * (left - from[0]), from[1] + share * (right - from[1])};
      force = drawer_->step(time_s_ += kTick_s, kTick_s, hands_);
    }
    return force;
  }

  DrawerSettings settings_{
      .front_x_m = 1.0, .front_y_m = 0.5, .handle_height_m = 0.92, .object_height_m = 0.90};
  std::unique_ptr<Drawer> drawer_;
  DrawerHands hands_{.p_W_m = {kFar, kFar}};
  double time_s_ = 0.0;
};

TEST_F(DrawerTest, IsWhereItsFiguresSay) {
  make(settings_);
  EXPECT_TRUE(drawer_->now().front_W_m.isApprox(Vector3d(1.0, 0.5, 0.0)));
  EXPECT_TRUE(drawer_->now().handle_W_m.isApprox(Vector3d(1.0, 0.64, 0.92)));
  EXPECT_TRUE(drawer_->now().object_W_m.isApprox(Vector3d(1.25, 0.5, 0.90)));
  settings_.yaw_rad = 0.5 * std::numbers::pi;
  make(settings_);  // faces a robot that comes along y
  EXPECT_TRUE(drawer_->now().handle_W_m.isApprox(Vector3d(0.86, 0.5, 0.92)));
  EXPECT_TRUE(drawer_->now().object_W_m.isApprox(Vector3d(1.0, 0.75, 0.90)));
}

TEST_F(DrawerTest, OpensWithTheHandAgainstFriction) {
  make(settings_);
  const Vector3d grip(1.004, 0.643, 0.92);  // 5 mm beside the handle
  move(grip, kFar, 10);
  move(grip, kFar, 30);
  EXPECT_FALSE(drawer_->now().held) << "nobody told it to";
  hands_.grips[0] = true;
  move(grip, kFar, 19);
  EXPECT_FALSE(drawer_->now().held) << "too soon";
  EXPECT_EQ(move(grip, kFar, 1), Vector3d::Zero());
  ASSERT_TRUE(drawer_->now().held);
  EXPECT_NEAR(*drawer_->handle_error_m(), 0.005, 1e-9);
  // 0.2 m in 1 s, away from the furniture: it pulls the hand back along its axis alone
  const Vector3d force = move(grip - Vector3d(0.2, 0.0, 0.0), kFar, 200);
  EXPECT_NEAR(drawer_->now().opened_m, 0.2, 1e-9);
  EXPECT_NEAR(force.x(), 7.0 * std::tanh(4.0) + 5.0 * 0.2, 1e-3);
  EXPECT_EQ(force.tail<2>().norm(), 0.0);
  EXPECT_TRUE(drawer_->now().handle_W_m.isApprox(Vector3d(0.8, 0.64, 0.92)));
  EXPECT_TRUE(drawer_->now().object_W_m.isApprox(Vector3d(1.05, 0.5, 0.90)));
  // a hand that stands still feels nothing; one that lets go leaves it open
  EXPECT_LT(move(hands_.p_W_m[0], kFar, 100).norm(), 1e-6);
  hands_.grips[0] = false;
  EXPECT_EQ(move(kFar, kFar, 50), Vector3d::Zero());
  EXPECT_FALSE(drawer_->now().held);
  EXPECT_NEAR(drawer_->now().opened_m, 0.2, 1e-9);
}

TEST_F(DrawerTest, EndStopsHoldUntilTheHandSlips) {
  make(settings_);
  hands_.grips[0] = true;
  const Vector3d handle = drawer_->now().handle_W_m;
  move(handle, kFar, 1);
  move(handle, kFar, 30);
  ASSERT_TRUE(drawer_->now().held);
  Vector3d force = move(handle + Vector3d(0.01, 0.0, 0.0), kFar, 100);
  force = move(handle + Vector3d(0.01, 0.0, 0.0), kFar, 100);  // pushes against the closed front
  EXPECT_NEAR(force.x(), -20.0, 1e-6);
  EXPECT_EQ(drawer_->now().opened_m, 0.0);
  force = move(handle - Vector3d(0.41, 0.0, 0.0), kFar, 400);
  force = move(handle - Vector3d(0.41, 0.0, 0.0), kFar, 100);
  EXPECT_NEAR(force.x(), 20.0, 1e-6);
  EXPECT_NEAR(drawer_->now().opened_m, 0.4, 1e-12);
  EXPECT_EQ(move(handle - Vector3d(0.43, 0.0, 0.0), kFar, 50).norm(), 0.0);
  EXPECT_FALSE(drawer_->now().held);
  hands_.grips[0] = false;
  move(drawer_->now().handle_W_m, kFar, 50);
  hands_.grips[0] = true;
  move(drawer_->now().handle_W_m, kFar, 30);
  EXPECT_TRUE(drawer_->now().held);
}

TEST_F(DrawerTest, TakenObjectGoesWithTheHand) {
  make(settings_);
  const Vector3d near = drawer_->now().object_W_m + Vector3d(0.0, 0.006, 0.008);
  hands_.grips[1] = true;
  move(kFar, near, 50);
  move(kFar, near, 30);
  ASSERT_TRUE(drawer_->now().taken);
  EXPECT_NEAR(*drawer_->reach_error_m(), 0.01, 1e-9);
  const Vector3d away(0.5, 0.0, 1.2);
  move(kFar, away, 50);
  EXPECT_TRUE(drawer_->now().object_W_m.isApprox(away));
}

TEST_F(DrawerTest, HandThatOnlyPassesTakesNothing) {
  make(settings_);
  hands_.grips = {true, true};
  const Vector3d object = drawer_->now().object_W_m;
  move(kFar, object + Vector3d(0.0, 0.2, 0.0), 10);
  move(kFar, object - Vector3d(0.0, 0.2, 0.0), 40);  // 2 m/s: 30 ms in reach
  EXPECT_FALSE(drawer_->now().taken);
  EXPECT_FALSE(drawer_->reach_error_m().has_value());
}

TEST_F(DrawerTest, JumpsClosedOutOfTheHand) {
  settings_.jumps = {{.at_s = 2.0, .by_m = -0.1}, {.at_s = 0.9, .by_m = 0.3}};
  make(settings_);
  hands_.grips[0] = true;
  const Vector3d handle = drawer_->now().handle_W_m;
  move(handle, kFar, 1);
  move(handle - Vector3d(0.1, 0.0, 0.0), kFar, 100);
  ASSERT_TRUE(drawer_->now().held);
  move(hands_.p_W_m[0], kFar, 100);  // past 0.9 s, at 1 m/s
  EXPECT_NEAR(drawer_->now().front_W_m.x(), 1.11, 0.011);
  EXPECT_FALSE(drawer_->now().held);
  move(hands_.p_W_m[0], kFar, 50);
  EXPECT_FALSE(drawer_->now().held);
  EXPECT_EQ(drawer_->now().opened_m, 0.0);
  EXPECT_TRUE(drawer_->now().front_W_m.isApprox(Vector3d(1.3, 0.5, 0.0)));
  move(kFar, kFar, 300);
  EXPECT_TRUE(drawer_->now().front_W_m.isApprox(Vector3d(1.2, 0.5, 0.0)));
}

TEST_F(DrawerTest, HandsWithoutPlaceDoNothing) {
  make(settings_);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  hands_.grips = {true, true};
  hands_.p_W_m = {Vector3d::Constant(nan), Vector3d::Constant(nan)};
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(drawer_->step(time_s_ += kTick_s, kTick_s, hands_), Vector3d::Zero());
  }
  EXPECT_FALSE(drawer_->now().held || drawer_->now().taken);
  EXPECT_TRUE(drawer_->now().object_W_m.allFinite());
}

}  // namespace
}  // namespace mimesis::hw::sim
