#include "hw/sim/drives/drives_node.h"

#include <gtest/gtest.h>

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
    arm = *graph.take<v1::JointState>("arm");
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

TEST(DrivesNode, RefusesAFaultOfAJointThatIsNotThere) {
  testing::Loopback graph;
  EXPECT_THROW(DrivesNode({.fault_axis = 8}, graph), ConfigError);
}

}  // namespace
}  // namespace mimesis::hw::sim
