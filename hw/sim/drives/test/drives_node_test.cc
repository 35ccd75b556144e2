#include "hw/sim/drives/drives_node.h"

#include <gtest/gtest.h>

#include <fstream>

#include "common/error.h"
#include "common/testing/loopback.h"
#include "hw/cia402/canopen.h"

namespace mimesis::hw::sim {
namespace {

using namespace std::chrono_literals;

TEST(DrivesNode, PublishesTheTruthAndMakesTroubleOnTime) {
  testing::Loopback graph;
  DrivesNode node({.fault_axis = 3, .fault_at_s = 0.1}, graph);
  auto tap = can::open("embedded:arm", graph.directory());
  int emergencies = 0;
  v1::JointState arm;
  for (runtime::Time now = 5s; now < 5200ms; now += 5ms) {
    node.step(now);
    arm = *graph.take<v1::JointState>("joint_states");
    EXPECT_EQ(arm.drives(2) == v1::DRIVE_STATE_SWITCH_ON_DISABLED, now < 5100ms) << now.count();
    std::array<can::Frame, 64> frames;
    const std::size_t count = tap->receive(frames);
    for (const can::Frame& f : std::span(frames).first(count)) {
      if (f == cia402::emergency(3, 0x2310, 3)) ++emergencies;
    }
  }
  EXPECT_EQ(emergencies, 1);
  EXPECT_EQ(arm.drives(2), v1::DRIVE_STATE_FAULT);
  ASSERT_EQ(arm.position_rad_size(), 7);
  EXPECT_DOUBLE_EQ(arm.position_rad(3), 1.6) << "home of the model";
}

/// The machine file of the bridge, two buses.
TEST(DrivesNode, TakesTheMachineFile) {
  testing::Loopback graph;
  const std::string file = graph.directory() + "/machine.yaml";
  std::ofstream out(file);
  out << "robot: lwr4.yaml\nbuses: [{can: \"embedded:upper\"}, {can: "
         "\"embedded:lower\"}]\njoints:\n";
  for (int i = 0; i < 7; ++i) {
    out << "  - {bus: " << i / 4 << ", node_id: " << 21 + i
        << ", increments_per_turn: 4096, gear_ratio: 100, sign: " << (i % 2 == 0 ? 1 : -1)
        << ", offset_rad: 0.2}\n";
  }
  out.close();
  auto upper = can::open("embedded:upper", graph.directory()),
       lower = can::open("embedded:lower", graph.directory());
  DrivesNode node({.machine = file, .fault_axis = 6, .fault_at_s = 0.0}, graph);
  node.step(5s);
  const auto boots = [](can::Bus& bus) {
    std::vector<std::uint32_t> ids;
    std::array<can::Frame, 64> frames;
    const std::size_t count = bus.receive(frames);
    for (const can::Frame& f : std::span(frames).first(count)) {
      if (f.id >= 0x700) ids.push_back(f.id - 0x700);
    }
    return ids;
  };
  EXPECT_EQ(boots(*upper), (std::vector<std::uint32_t>{21, 22, 23, 24}));
  EXPECT_EQ(boots(*lower), (std::vector<std::uint32_t>{25, 26, 27}));
  const auto arm = *graph.take<v1::JointState>("joint_states");
  EXPECT_DOUBLE_EQ(arm.position_rad(3), 1.6) << "home of the model";
  node.step(5s + 5ms);
  EXPECT_EQ(graph.take<v1::JointState>("joint_states")->drives(5), v1::DRIVE_STATE_FAULT)
      << "on the second bus";
  EXPECT_THROW(DrivesNode({.machine = file, .axes = {{.node_id = 1}}}, graph), ConfigError);
}

TEST(DrivesNode, RefusesAFaultOfAJointThatIsNotThere) {
  testing::Loopback graph;
  EXPECT_THROW(DrivesNode({.fault_axis = 8}, graph), ConfigError);
}

}  // namespace
}  // namespace mimesis::hw::sim
