#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "common/testing/loopback.h"
#include "hw/bridge/bridge_node.h"
#include "hw/sim/body/sim_body_node.h"

namespace mimesis::hw::sim {

using namespace std::chrono_literals;
using Time = runtime::Time;

inline std::vector<BusShare> four_buses() {
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
    const Joints joints = load_joints("biped.yaml");
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
    params.enable = "auto";
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
  /// A step of the bridge, with a command if `speak`.
  void step_bridge(bool speak = true) {
    if (!bridge) return;
    if (speak) {
      v1::JointCommand command;
      for (const double q : target) command.add_position_rad(q);
      bridge_graph->send("command", command, now);
    }
    bridge->step(now + 1250us);
    if (auto s = bridge_graph->take_last<v1::BridgeStatus>("status")) status = *s;
    if (auto a = bridge_graph->take_last<v1::JointState>("joint_states")) feedback = *a;
  }
  void tick(bool speak) {
    step_bridge(speak);
    body->step(now + 2500us);
    now += kTick;
    truth = *body_graph.take_last<v1::BodyTruth>("truth");
    drives = *body_graph.take_last<v1::JointState>("joint_states");
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

  mimesis::testing::Loopback body_graph;
  // graph of the bridge that runs, or ran last
  std::optional<mimesis::testing::Loopback> bridge_graph;
  std::optional<SimBodyNode> body;
  std::optional<bridge::BridgeNode> bridge;
  Time now = 1s;
  std::vector<std::string> names;
  std::vector<double> home, target;
  v1::BridgeStatus status;
  v1::JointState feedback, drives;
  v1::BodyTruth truth;
  v1::BodySensors sensors;
  std::vector<v1::WalkOutcome> outcomes;
};

}  // namespace mimesis::hw::sim
