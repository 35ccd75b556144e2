#include <gtest/gtest.h>

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

TEST(RootMotion, TheHeadingTurnsAsToldAndThePelvisGoesAlongIt) {
  CharacterBatch batch(walking_model({.speed_m_s = 0.8}), 1, {.dt_s = 1.0 / 100.0});
  batch.set_turn(0, 0.5);
  for (int n = 0; n < 400; ++n) batch.step();
  const RootPose root = batch.root(0);
  EXPECT_NEAR(root.heading_rad, 2.0, 0.005);
  EXPECT_NEAR(root.yaw_rate_rad_s, 0.5, 0.01);
  EXPECT_NEAR(root.position_W_m.x(), 1.6 * std::sin(2.0), 0.05);
  EXPECT_NEAR(root.position_W_m.y(), 1.6 * (1.0 - std::cos(2.0)), 0.05);
}

TEST(RootMotion, WhatDoesNotWalkStandsOnBothFeet) {
  motion::MotionModel model = walking_model();
  model.patterns.front().weight_rad.setZero();
  model.patterns.front().mean_rad.setZero();
  CharacterBatch batch(model, 1, {.dt_s = 1.0 / 100.0, .foot_lock = true});
  for (int n = 0; n < 100; ++n) batch.step();
  EXPECT_EQ(batch.root(0).position_W_m, Eigen::Vector2d(0.0, 0.0));
  for (const int side : {mocap::kLeft, mocap::kRight}) {
    EXPECT_NEAR(batch.heel_W_m(0, side).z(), 0.0, 2e-3);
    EXPECT_NEAR(batch.toe_W_m(0, side).z(), 0.0, 2e-3);
  }
}

/// Largest change of a velocity from one step to the next, at 200 Hz.
struct Changes {
  double velocity_m_s = 0.0, yaw_rad_s = 0.0;  ///< velocities as moved
  double travelled_m = 0.0;
};
Changes changes(const motion::MotionModel& model) {
  CharacterBatch batch(model, 1, {.dt_s = 1.0 / 200.0});
  Changes most;
  RootPose before;
  for (int n = 0; n < 1400; ++n) {
    batch.step();
    const RootPose root = batch.root(0);
    if (n >= 400) {
      most.velocity_m_s =
          std::max(most.velocity_m_s, (root.velocity_H_m_s - before.velocity_H_m_s).norm());
      most.yaw_rad_s =
          std::max(most.yaw_rad_s, std::abs(root.yaw_rate_rad_s - before.yaw_rate_rad_s));
      most.travelled_m += root.velocity_H_m_s.x() / 200.0;
    }
    before = root;
  }
  return most;
}

TEST(RootMotion, VelocityDoesNotJumpWhereTheFeetChange) {
  // the feet of this walker differ by 1/3 m/s, one ahead of the pelvis, one behind
  const Changes sliding = changes(walking_model({.slide_m = 0.1}));
  const Changes exact = changes(walking_model());
  EXPECT_LT(sliding.velocity_m_s, 0.02);  // 4 m/s2
  EXPECT_NEAR(sliding.travelled_m, exact.travelled_m, 0.04);
}

}  // namespace
}  // namespace mimesis::synthesizer
