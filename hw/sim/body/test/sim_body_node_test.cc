// Bridge and simulated body on four CAN buses, in explicit time.
#include "hw/sim/body/sim_body_node.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "common/error.h"
#include "common/testing/loopback.h"
#include "hw/bridge/bridge_node.h"

namespace mimesis::hw::sim {
namespace {

using namespace std::chrono_literals;
using Time = runtime::Time;

std::vector<BusShare> four_buses() {
  return {{"embedded:left_leg", 6},
          {"embedded:right_leg", 6},
          {"embedded:waist_left_arm", 9},
          {"embedded:neck_right_arm", 9}};
}

/// Two graphs whose CAN buses are the same: nodes of one Loopback would share their ports too.
class Robot : public ::testing::Test {
 protected:
  static constexpr Time kTick = 5ms;

  Robot() {
    const Joints joints = load_joints("biped.yaml", 300.0);
    names = joints.names;
    home.assign(joints.home.begin(), joints.home.end());
    target = home;
  }

  void start_body(SimBodyParams params = {}) {
    params.buses = four_buses();
    body.emplace(params, body_graph);
  }
  void start_bridge(bridge::BridgeParams params = {}) {
    params.robot = "biped.yaml";
    params.buses = four_buses();
    params.hand = "";
    params.start_tolerance_rad = 0.05;
    bridge_graph.emplace();
    for (const BusShare& bus : four_buses()) {
      const std::string folder = "/can-" + bus.can.substr(bus.can.find(':') + 1);
      std::filesystem::create_directory_symlink(body_graph.directory() + folder,
                                                bridge_graph->directory() + folder);
    }
    bridge.emplace(params, *bridge_graph);
  }
  void tick(bool speak) {
    if (speak && bridge) {
      v1::JointCommand command;
      for (const double q : target) command.add_position_rad(q);
      bridge_graph->send("command", command, now);
    }
    if (bridge) {
      bridge->step(now + 1250us);
      if (auto s = bridge_graph->take_last<v1::BridgeStatus>("status")) status = *s;
      if (auto a = bridge_graph->take_last<v1::ArmState>("arm")) feedback = *a;
    }
    body->step(now + 2500us);
    now += kTick;
    truth = *body_graph.take_last<v1::BodyTruth>("truth");
    drives = *body_graph.take_last<v1::ArmState>("arm");
    sensors = *body_graph.take_last<v1::BodySensors>("sensors");
    body_graph.take_last<foxglove::FrameTransforms>("transforms");
    if (auto o = body_graph.take<v1::WalkOutcome>("outcome")) outcomes.push_back(*o);
  }
  void run(Time duration, bool speak = true) {
    for (const Time end = now + duration; now < end;) tick(speak);
  }
  void start() {
    start_body();
    start_bridge();
    run(1s);
    ASSERT_EQ(status.state(), "following") << status.reason();
    ASSERT_TRUE(feedback.operational());
  }
  std::size_t joint(const std::string& name) const {
    return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
  }
  int count(v1::DriveState state) const {
    return static_cast<int>(std::ranges::count(drives.drives(), static_cast<int>(state)));
  }
  double foot_force() const { return sensors.feet(0).force_z_n() + sensors.feet(1).force_z_n(); }
  /// Knees bend by 2a more; soles and trunk keep their attitude.
  void squat(double a) {
    for (const std::string side : {"left", "right"}) {
      target[joint(side + "_hip_pitch")] = home[joint(side + "_hip_pitch")] - a;
      target[joint(side + "_knee")] = home[joint(side + "_knee")] + 2.0 * a;
      target[joint(side + "_ankle_pitch")] = home[joint(side + "_ankle_pitch")] - a;
    }
  }
  void expect_stands(Time duration, bool speak, const std::string& what) {
    double sum = 0.0, most_drift = 0.0;
    int n = 0;
    const double x = truth.com_in_world_m().x_m(), y = truth.com_in_world_m().y_m();
    for (const Time end = now + duration; now < end; ++n) {
      tick(speak);
      sum += foot_force();
      most_drift = std::max(most_drift, std::hypot(truth.com_in_world_m().x_m() - x,
                                                   truth.com_in_world_m().y_m() - y));
    }
    EXPECT_FALSE(truth.fell()) << what << ": " << truth.how();
    const double weight = 58.0 * robot::kGravity;
    EXPECT_NEAR(sum / n, weight, 0.01 * weight) << what;
    EXPECT_LT(most_drift, 0.02) << what;
  }

  testing::Loopback body_graph;
  std::optional<testing::Loopback> bridge_graph;  // of the bridge that runs, or ran last
  std::optional<SimBodyNode> body;
  std::optional<bridge::BridgeNode> bridge;
  Time now = 1s;
  std::vector<std::string> names;
  std::vector<double> home, target;
  v1::BridgeStatus status;
  v1::ArmState feedback, drives;
  v1::BodyTruth truth;
  v1::BodySensors sensors;
  std::vector<v1::WalkOutcome> outcomes;
};

TEST_F(Robot, StandsOnItsBrakesThenPowered) {
  start_body();
  run(1s);
  EXPECT_EQ(count(v1::DRIVE_STATE_SWITCH_ON_DISABLED), 30);
  expect_stands(1s, false, "on its brakes");
  start_bridge();
  run(1s);
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
  EXPECT_EQ(status.can_frames_sent() - before.can_frames_sent(),
            seconds * (200 * (30 + 4) + 10 * 4));
  EXPECT_EQ(status.can_frames_received() - before.can_frames_received(),
            seconds * (200 * 2 * 30 + 10 * 30));
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
  EXPECT_EQ(status.reason(), "left_ankle_roll (node 6): no feedback for 0.1 s");
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

TEST_F(Robot, TakesPushesAndMotorFaultsAsMessages) {
  start();
  v1::BodyTrouble trouble;
  trouble.set_push_x_n_s(15.0);
  trouble.set_push_duration_s(0.1);
  body_graph.send("trouble", trouble, now);
  double fastest = 0.0;
  for (int k = 0; k < 40; ++k) {
    tick(true);
    fastest = std::max(fastest, truth.com_velocity_in_world().x_m_s());
  }
  EXPECT_NEAR(fastest, 15.0 / 58.0, 0.1) << "what the feet do not take away";
  trouble.Clear();
  trouble.set_motor("left_knee");
  trouble.set_motor_fault("off");
  body_graph.send("trouble", trouble, now);
  trouble.set_motor("tail");
  body_graph.send("trouble", trouble, now);
  run(2s);
  EXPECT_EQ(status.state(), "fault") << "following error of the limp knee";
  EXPECT_NE(status.reason().find("left_knee (node 4)"), std::string::npos) << status.reason();
  EXPECT_TRUE(truth.fell());
  ASSERT_EQ(outcomes.size(), 1u);
  EXPECT_TRUE(outcomes[0].fell());
  EXPECT_EQ(outcomes[0].reason(), "fell: " + truth.how());
}

TEST_F(Robot, ReachesTheGoalOnceItStandsThere) {
  start_body({.time_limit_s = 5.0, .settle_s = 0.5});
  start_bridge();
  run(1s);
  v1::WalkFeedback walk;
  walk.set_state(v1::WALK_STATE_STANDING);
  v1::MotionStatus motion;
  body_graph.send("walk", walk, now);
  run(1s);
  EXPECT_TRUE(outcomes.empty());
  motion.set_reached(true);
  body_graph.send("motion", motion, now);
  run(480ms);
  EXPECT_TRUE(outcomes.empty());
  run(5s);
  ASSERT_EQ(outcomes.size(), 1u) << "once";
  EXPECT_TRUE(outcomes[0].success());
  EXPECT_NEAR(outcomes[0].normal_peak_n(), 569.0, 10.0);
}

TEST_F(Robot, TimeIsUp) {
  start_body({.time_limit_s = 0.5});
  run(1s);
  ASSERT_EQ(outcomes.size(), 1u);
  EXPECT_FALSE(outcomes[0].success());
  EXPECT_EQ(outcomes[0].reason(), "goal not reached in time");
}

TEST(SimBody, RefusesBadConfigurationInOneLine) {
  const auto refusal = [](const SimBodyParams& params) -> std::string {
    testing::Loopback graph;
    try {
      SimBodyNode node(params, graph);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "accepted";
  };
  EXPECT_EQ(refusal({.buses = {{"embedded:a", 29}}}), "buses: carry 29 joints, the robot has 30");
  EXPECT_NE(refusal({.faults = {{.joint = "tail"}}}).find("'tail'"), std::string::npos);
  EXPECT_NE(refusal({.pushes = {{.link = "tail"}}}).find("'tail'"), std::string::npos);
  EXPECT_NE(refusal({.robot = "nobody.yaml"}).find("nobody.yaml"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::hw::sim
