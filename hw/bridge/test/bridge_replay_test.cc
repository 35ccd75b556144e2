// The node's outputs are a function of its inputs and of the recorded data of drives and hand.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <functional>

#include "common/model/files.h"
#include "common/testing/loopback.h"
#include "common/testing/outside_tape.h"
#include "hw/bridge/bridge_node.h"
#include "hw/sim/cia402/drive.h"
#include "hw/sim/hand/hand.h"

namespace mimesis::hw::bridge {
namespace {

using namespace std::chrono_literals;
using Outputs = std::map<std::string, std::vector<std::string>>;

/// Seven drives and a hand on the buses of `graph`.
class Hardware {
 public:
  explicit Hardware(testing::Loopback& graph)
      : rack_(configs(), can::open("embedded:arm", graph.directory())),
        server_(modbus::parse_address("unix:hand", graph.directory())) {}

  void step(runtime::Time now) {
    rack_.step(now);
    plant_.step(0.005, server_.exchange(plant_.input()), 0.5);
  }

 private:
  static std::vector<sim::DriveConfig> configs() {
    const kin::ArmModel model = model::load_arm("lwr4.yaml");
    std::vector<sim::DriveConfig> drives;
    for (Eigen::Index i = 0; i < model.dof(); ++i)
      drives.push_back({.axis = {.node_id = static_cast<int>(i) + 1}, .home_rad = model.home[i]});
    return drives;
  }

  sim::Rack rack_;
  sim::HandServer server_;
  sim::HandPlant plant_{{}};
};

/// `steps` cycles of a stream that moves the second joint and closes the hand. `after` each step.
Outputs run(testing::Loopback& graph, int steps, const std::function<void(runtime::Time)>& after) {
  const kin::ArmModel model = model::load_arm("lwr4.yaml");
  BridgeNode node({.enable = "auto"}, graph);
  runtime::Time now = 1s;
  for (int k = 0; k < steps; ++k, now += 5ms) {
    v1::JointCommand command;
    for (const double q : model.home) command.add_position_rad(q);
    const double moving_s = std::max(0.0, 0.005 * (k - 200));
    command.set_position_rad(1, model.home[1] + 0.1 * (1.0 - std::cos(M_PI * moving_s)));
    if (k % 300 < 250) graph.send("command", command, now - 5ms);  // falls silent now and then
    if (k == 250) {
      v1::HandCommand close;
      close.set_grip(v1::GRIP_PRECISION);
      close.set_closure(1.0);
      graph.send("hand_command", close, now);
    }
    node.step(now);
    after(now + 2500us);
  }
  node.stop(now);
  return graph.take_all();
}

class BridgeReplay : public ::testing::TestWithParam<bool> {};

TEST_P(BridgeReplay, GivesTheSameBytesWithoutAnyBus) {
  const bool lockstep = GetParam();
  constexpr int kSteps = 700;
  testing::OutsideTape tape;
  Outputs live;
  {
    testing::Loopback graph({.lockstep = lockstep, .outside = &tape});
    Hardware hardware(graph);
    live = run(graph, kSteps, [&](runtime::Time now) { hardware.step(now); });
  }
  v1::BridgeStatus status;
  ASSERT_TRUE(status.ParseFromString(live["status"].back()));
  EXPECT_GT(status.can_frames_received(), 1000u);
  EXPECT_GT(live["status"].size(), 8u) << "starting, idle, enabling, following, quick stop ...";
  v1::HandState hand;
  ASSERT_TRUE(hand.ParseFromString(live["hand"].back()));
  EXPECT_TRUE(hand.active() || !lockstep) << "on a thread nobody knows when it connects";

  tape.rewind();
  testing::Loopback graph({.lockstep = lockstep, .outside = &tape});
  const Outputs replayed = run(graph, kSteps, [](runtime::Time) {});
  EXPECT_EQ(tape.problem(), "");
  EXPECT_TRUE(tape.at_end());
  EXPECT_EQ(replayed, live);
  EXPECT_TRUE(std::filesystem::is_empty(graph.directory())) << "a socket was made";
}

INSTANTIATE_TEST_SUITE_P(Hand, BridgeReplay, ::testing::Bool(),
                         [](const auto& hand) { return hand.param ? "InLockstep" : "OnAThread"; });

TEST(BridgeNode, ARecordOfSomethingElseIsReportedAndEndsNothing) {
  testing::OutsideTape tape;
  {
    testing::Loopback graph({.lockstep = true, .outside = &tape});
    Hardware hardware(graph);
    run(graph, 100, [&](runtime::Time now) { hardware.step(now); });
  }
  tape.entries()[50].name = "lidar";
  tape.rewind();
  testing::Loopback graph({.lockstep = true, .outside = &tape});
  run(graph, 100, [](runtime::Time) {});
  EXPECT_NE(tape.problem().find("entry 50: the node has "), std::string::npos) << tape.problem();
  EXPECT_NE(tape.problem().find("'lidar'"), std::string::npos) << tape.problem();
}

}  // namespace
}  // namespace mimesis::hw::bridge
