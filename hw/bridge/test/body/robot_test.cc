// Bridge and drives of a simulated body on four CAN buses, in explicit time.
#include "hw/bridge/test/body/robot.h"

namespace mimesis::hw::sim {
namespace {

TEST_F(Robot, StandsOnItsBrakesThenPowered) {
  start_body();
  run(1s);
  EXPECT_EQ(count(v1::DRIVE_STATE_SWITCH_ON_DISABLED), 30);
  expect_stands(1s, false, "on its brakes");
  start_bridge();
  for (int k = 0; k < 200; ++k) {
    tick(true);
    EXPECT_NEAR(foot_force(), 58.0 * robot::kGravity, 15.0) << "enabled where its motors are held";
  }
  ASSERT_EQ(status.state(), "following") << status.reason();
  EXPECT_EQ(count(v1::DRIVE_STATE_OPERATION_ENABLED), 30);
  const v1::BridgeStatus before = status;
  expect_stands(2s, true, "powered");
  for (int i = 0; i < 30; ++i) {
    EXPECT_NEAR(feedback.position_rad(i), home[static_cast<std::size_t>(i)], 0.01)
        << names[static_cast<std::size_t>(i)];
  }
  EXPECT_EQ(status.commands_limited(), 0u);
  EXPECT_EQ(status.can_errors(), before.can_errors());
  EXPECT_GT(sensors.specific_force_in_imu().z_m_s2(), 9.7);
}

TEST_F(Robot, CountsTheFramesOfEveryBus) {
  start();
  run(1s);
  const v1::BridgeStatus before = status;
  run(2s);
  const std::uint64_t seconds =
      (status.header().stamp_ns() - before.header().stamp_ns()) / 1'000'000'000;
  ASSERT_GE(seconds, 1u);
  // A set-point of each axis and SYNC in each cycle, heartbeats at 10 Hz; two answers of each axis.
  // On each bus one object a second is read again.
  EXPECT_EQ(status.can_frames_sent() - before.can_frames_sent(),
            seconds * (200 * (30 + 4) + 10 * 4 + 4));
  EXPECT_EQ(status.can_frames_received() - before.can_frames_received(),
            seconds * (200 * 2 * 30 + 10 * 30 + 4));
}

TEST_F(Robot, FollowsASquat) {
  start();
  const double height = truth.position_pelvis_in_world_m().z_m();
  double worst = 0.0;
  for (int k = 1; k <= 300; ++k) {
    squat(0.075 * (1.0 - std::cos(M_PI * k / 300.0)));
    tick(true);
    for (int i = 0; i < 30; ++i) {
      worst =
          std::max(worst, std::abs(drives.position_rad(i) - target[static_cast<std::size_t>(i)]));
    }
  }
  EXPECT_LT(worst, 0.02) << "lag of two ticks and the springs' sag";
  expect_stands(1s, true, "down");
  const double q_h = 0.4537856055185257, q_a = 0.4188790204786391, a = 0.15;
  const double expected =
      0.3 * (std::cos(q_h + a) + std::cos(q_a + a) - std::cos(q_h) - std::cos(q_a));
  EXPECT_NEAR(truth.position_pelvis_in_world_m().z_m() - height, expected, 0.003);
  EXPECT_EQ(status.commands_limited(), 0u);
}

TEST_F(Robot, HoldsPoweredWhenTheWalkerIsSilent) {
  start();
  for (int k = 1; k <= 100; ++k) {
    squat(0.0015 * k);
    tick(true);
  }
  run(150ms, false);
  EXPECT_EQ(status.reason(), "no command for 0.1 s: holding");
  EXPECT_EQ(count(v1::DRIVE_STATE_OPERATION_ENABLED), 30);
  expect_stands(3s, false, "silent");
  EXPECT_EQ(count(v1::DRIVE_STATE_OPERATION_ENABLED), 30) << "not even the drives' watchdogs";
  target[joint("left_knee")] += 0.3;
  run(100ms);
  EXPECT_NE(status.reason().find("left_knee starts "), std::string::npos) << status.reason();
  target[joint("left_knee")] -= 0.3;
  run(100ms);
  EXPECT_EQ(status.state(), "following");
  EXPECT_EQ(status.reason(), "");
}

TEST_F(Robot, StandsWhenTheBridgeIsKilledAndTakesANewOne) {
  start();
  bridge.reset();  // without a word
  run(260ms, false);
  EXPECT_EQ(count(v1::DRIVE_STATE_QUICK_STOP_ACTIVE), 30) << "stopped by themselves, powered";
  expect_stands(3s, false, "without a bridge");
  start_bridge();
  run(1s, false);
  EXPECT_EQ(status.state(), "holding") << status.reason();
  EXPECT_EQ(count(v1::DRIVE_STATE_QUICK_STOP_ACTIVE), 30) << "never without power";
  for (int i = 0; i < 30; ++i) target[static_cast<std::size_t>(i)] = feedback.position_rad(i);
  run(200ms);
  EXPECT_EQ(status.state(), "following") << status.reason();
  expect_stands(1s, true, "with a new bridge");
}

TEST_F(Robot, AQuickStopKeepsItStanding) {
  start();
  bridge->stop(now);
  bridge.reset();
  run(20ms, false);
  EXPECT_EQ(count(v1::DRIVE_STATE_QUICK_STOP_ACTIVE), 30);
  EXPECT_TRUE(body->at_rest());
  expect_stands(2s, false, "after SIGTERM");
}

TEST_F(Robot, ADriveFaultStopsAllBusesAndItStands) {
  start_body({.faults = {{.at_s = 1.5, .joint = "right_elbow", .kind = "overcurrent"}}});
  start_bridge();
  run(1400ms);
  ASSERT_EQ(status.state(), "following") << status.reason();
  run(200ms);
  EXPECT_EQ(status.state(), "fault");
  EXPECT_NE(status.reason().find("right_elbow (node 27): expected operation enabled, is fault"),
            std::string::npos)
      << status.reason();
  EXPECT_EQ(count(v1::DRIVE_STATE_QUICK_STOP_ACTIVE), 29);
  EXPECT_EQ(drives.drives(static_cast<int>(joint("right_elbow"))), v1::DRIVE_STATE_FAULT);
  EXPECT_EQ(feedback.fault(), status.reason());
  expect_stands(2s, true, "one drive in fault, its brake on");
  EXPECT_EQ(status.state(), "fault") << "whoever goes on talking gets nothing";
}

TEST_F(Robot, ACutCableOfOneDriveStopsAllBuses) {
  start_body({.faults = {{.at_s = 1.5, .joint = "left_ankle_roll", .kind = "mute"}}});
  start_bridge();
  run(1700ms);
  EXPECT_EQ(status.state(), "fault");
  EXPECT_EQ(status.reason(),
            "left_ankle_roll (node 6): no feedback on 2 SYNCs that others have answered");
  run(200ms);
  EXPECT_EQ(count(v1::DRIVE_STATE_QUICK_STOP_ACTIVE), 30) << "the mute one by its own watchdog";
  expect_stands(2s, true, "with a cut cable");
}

TEST_F(Robot, ACommandIsInTheMotorsOneTickAfterItWasTakenIn) {
  start();
  const std::size_t elbow = joint("left_elbow");
  target[elbow] += 0.001;
  const double before = drives.position_rad(static_cast<int>(elbow));
  tick(true);  // bridge and drive take it in
  EXPECT_NEAR(drives.position_rad(static_cast<int>(elbow)), before, 1e-5);
  tick(true);  // the drive moves its motor there
  EXPECT_GT(drives.position_rad(static_cast<int>(elbow)), before + 1e-4);
  tick(true);
  tick(true);
  EXPECT_NEAR(drives.position_rad(static_cast<int>(elbow)), before + 0.001, 3e-4);
}

}  // namespace
}  // namespace mimesis::hw::sim
