#include "hw/sim/powercube/powercube_node.h"

#include <gtest/gtest.h>

#include <bit>
#include <cstring>

#include "common/testing/loopback.h"

namespace mimesis::hw::sim {
namespace {

using namespace std::chrono_literals;

TEST(PowercubeNode, AnswersOnItsBusAndPublishesTheTruth) {
  testing::Loopback graph;
  PowercubeNode node({}, graph);
  const auto master = can::open("embedded:arm", graph.directory());
  master->send(std::array{
      can::Frame{.id = 0x0C4, .length = 2, .data = {0x0A, 0x3C}}});  // position of module 4
  node.step(5s);
  std::array<can::Frame, 16> frames;
  ASSERT_EQ(master->receive(frames), 1u);
  EXPECT_EQ(frames[0].id, 0x0A4u);
  float position = 0.0f;
  std::memcpy(&position, &frames[0].data[2], 4);
  EXPECT_FLOAT_EQ(position, 1.6f) << "home of the model";
  v1::JointState arm = *graph.take<v1::JointState>("joint_states");
  ASSERT_EQ(arm.position_rad_size(), 7);
  EXPECT_DOUBLE_EQ(arm.position_rad(3), 1.6);
  EXPECT_EQ(arm.drives(3), v1::DRIVE_STATE_SWITCH_ON_DISABLED) << "halted at power-on";
  // Reset, then a step of 0.01 rad in 20 ms.
  const std::uint32_t to = std::bit_cast<std::uint32_t>(1.61f);
  can::Frame step{.id = 0x0E4, .length = 8, .data = {0x0B, 0x10, 0, 0, 0, 0, 20, 0}};
  for (std::size_t i = 0; i < 4; ++i) step.data[2 + i] = static_cast<std::uint8_t>(to >> 8 * i);
  master->send(std::array{can::Frame{.id = 0x100, .length = 1}, step});
  for (runtime::Time now = 5s; now <= 5s + 30ms; now += 5ms) node.step(now);
  arm = *graph.take_last<v1::JointState>("joint_states");
  EXPECT_NEAR(arm.position_rad(3), 1.61, 1e-6);
  EXPECT_TRUE(arm.operational());
}

}  // namespace
}  // namespace mimesis::hw::sim
