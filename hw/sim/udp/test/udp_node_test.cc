#include "hw/sim/udp/udp_node.h"

#include <gtest/gtest.h>

#include "common/testing/loopback.h"
#include "common/testing/refusal.h"

namespace mimesis::hw::sim {
namespace {

using namespace std::chrono_literals;

TEST(UdpNode, AnswersItsMasterAndPublishesTheTruth) {
  testing::Loopback graph;
  UdpNode node({.address = "127.0.0.1:27217"}, graph);
  const auto link = udp::connect("127.0.0.1:27217");
  node.step(1s);
  EXPECT_TRUE(link->receive().empty()) << "nobody has asked";
  std::string command("MJC1\5\0\0\0\1\0\0\0\0\0\0\0\0\7\x64\0\0\0\0\0", 24);
  command.append(7 * 16, '\0');
  ASSERT_TRUE(link->send(command));
  node.step(1s + 5ms);
  const std::vector<std::string> states = link->receive();
  ASSERT_EQ(states.size(), 1u);
  EXPECT_EQ(states[0].size(), 24u + 7 * 24);
  EXPECT_EQ(states[0].substr(0, 4), "MJS1");
  EXPECT_EQ(states[0].substr(20, 4), std::string("\5\0\0\0", 4)) << "it obeys us";
  const v1::JointState joints = *graph.take_last<v1::JointState>("joint_states");
  ASSERT_EQ(joints.position_rad_size(), 7);
  EXPECT_DOUBLE_EQ(joints.position_rad(3), 1.6);
  EXPECT_FALSE(joints.operational());
}

TEST(UdpNode, RefusesAddresses) {
  for (const char* wrong :
       {"30200", "127.0.0.1:", "127.0.0.1:x", ":1", "127.0.0.1:302000", "nobody.invalid:1"}) {
    testing::Loopback graph;
    const std::string refused =
        testing::refusal([&] { UdpNode node({.address = wrong}, graph); }, "accepted");
    EXPECT_TRUE(refused.starts_with("UDP '" + std::string(wrong) + "': ")) << refused;
  }
}

}  // namespace
}  // namespace mimesis::hw::sim
