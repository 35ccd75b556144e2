#include "hw/perfect_actuators.h"

#include <gtest/gtest.h>

#include <array>

namespace mimesis::hw {
namespace {

PerfectActuators two_perfect_joints(bool stays_powered, bool readonly = false) {
  const auto all = [](double x) { return Eigen::VectorXd::Constant(2, x); };
  return PerfectActuators(
      {.limits = {.q_min = all(-1), .q_max = all(1), .v_max = all(2), .a_max = all(100)},
       .home_rad = {0.1, -0.1},
       .stays_powered = stays_powered,
       .readonly = readonly});
}

TEST(PerfectActuators, AreWhereTheyAreToldToBeWithinTheLimits) {
  PerfectActuators joints = two_perfect_joints(false);
  EXPECT_TRUE(joints.read({}).posture_known);
  EXPECT_EQ(joints.read({}).phase, Phase::idle);
  std::array target = {0.1, -0.1};
  const auto follow = [&] { joints.write({}, {.mode = Mode::follow, .position_rad = target}); };
  follow();
  EXPECT_EQ(joints.read({}).phase, Phase::following);
  target[0] += 1e-3;  // 0.2 rad/s, 40 rad/s²
  follow();
  EXPECT_DOUBLE_EQ(joints.read({}).joints[0].position_rad, target[0]);
  EXPECT_EQ(joints.read({}).joints[0].drive, DriveState::operation_enabled);
  EXPECT_EQ(joints.read({}).limited, 0u);
  target[1] = -1.0;
  follow();
  EXPECT_EQ(joints.read({}).limited, 1u);
  for (int i = 0; i < 400; ++i) follow();
  EXPECT_NEAR(joints.read({}).joints[1].position_rad, -1.0, 1e-9);
}

TEST(PerfectActuators, StopAsTheRobotsKindDoes) {
  for (const bool stays_powered : {false, true}) {
    PerfectActuators joints = two_perfect_joints(stays_powered);
    const std::array target = {0.1, -0.1};
    joints.write({}, {.mode = Mode::follow, .position_rad = target});
    ASSERT_EQ(joints.read({}).phase, Phase::following);
    joints.stop();
    EXPECT_EQ(joints.read({}).phase, stays_powered ? Phase::holding : Phase::idle);
    EXPECT_EQ(joints.read({}).joints[0].velocity_rad_s, 0.0);
    joints.write({}, {.mode = Mode::follow, .position_rad = target});
    EXPECT_EQ(joints.read({}).phase, Phase::following) << "again from there";
  }
}

TEST(PerfectActuators, ThatAreOnlyReadNeverMove) {
  PerfectActuators joints = two_perfect_joints(false, true);
  const std::array target = {0.5, 0.5};
  for (int i = 0; i < 10; ++i) joints.write({}, {.mode = Mode::follow, .position_rad = target});
  EXPECT_EQ(joints.read({}).phase, Phase::idle);
  EXPECT_EQ(joints.read({}).reason, "read-only");
  EXPECT_EQ(joints.read({}).joints[0].position_rad, 0.1);
}

}  // namespace
}  // namespace mimesis::hw
