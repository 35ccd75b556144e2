#include "hw/sim/hand/hand_node.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "common/testing/loopback.h"
#include "common/testing/outside_tape.h"
#include "hw/modbus/hand.h"

namespace mimesis::hw::sim {
namespace {

using namespace std::chrono_literals;
using Outputs = std::map<std::string, std::vector<std::string>>;

Outputs run(testing::Loopback& graph, const std::function<void(runtime::Time)>& after_step) {
  HandNode node({}, graph);
  for (runtime::Time now = 5s; now < 8s; now += 10ms) {
    v1::HandContact contact;
    contact.set_reachable(true);
    contact.set_contact_closure(0.4);
    if (now == 6s) graph.send("contact", contact, now);
    node.step(now);
    after_step(now);
  }
  return graph.take_all();
}

TEST(HandNode, ReplayedGivesTheSameBytesWithoutAServer) {
  testing::OutsideTape tape;
  Outputs live;
  {
    testing::Loopback graph({.lockstep = false, .outside = &tape});
    modbus::HandClient client(modbus::parse_address("unix:hand", graph.directory()),
                              modbus::load_hand_profile("hands/robotiq_3f.yaml"), 5000ms);
    live = run(graph, [&](runtime::Time now) {
      client.exchange(now, {.move = now > 5700ms, .closure = 1.0});
    });
  }
  v1::HandState last;
  ASSERT_TRUE(last.ParseFromString(live["hand"].back()));
  EXPECT_TRUE(last.object_detected());
  EXPECT_NEAR(last.closure(), 0.4, 1e-9);

  tape.rewind();
  testing::Loopback graph({.lockstep = false, .outside = &tape});
  EXPECT_EQ(run(graph, [](runtime::Time) {}), live);
  EXPECT_EQ(tape.problem(), "");
  EXPECT_TRUE(tape.at_end());
  EXPECT_TRUE(std::filesystem::is_empty(graph.directory())) << "a socket was made";

  tape.entries()[7].name = "can";
  tape.rewind();
  testing::Loopback other({.lockstep = false, .outside = &tape});
  run(other, [](runtime::Time) {});
  EXPECT_EQ(tape.problem(), "entry 7: the node has read 'hand', the record read 'can'");
}

}  // namespace
}  // namespace mimesis::hw::sim
