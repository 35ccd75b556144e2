#include <gtest/gtest.h>

#include <filesystem>
#include <functional>

#include "common/testing/loopback.h"
#include "common/testing/outside_tape.h"
#include "hw/cia402/cia402.h"
#include "hw/sim/drives/drives_node.h"

namespace mimesis::hw::sim {
namespace {

using namespace std::chrono_literals;
using Outputs = std::map<std::string, std::vector<std::string>>;

Outputs run(testing::Loopback& graph, const std::function<void()>& before_step) {
  DrivesNode node({.fault_axis = 3, .fault_at_s = 0.5}, graph);
  for (runtime::Time now = 5s; now < 6s; now += 5ms) {
    before_step();
    node.step(now);
  }
  return graph.take_all();
}

TEST(DrivesNode, ReplayedGivesTheSameBytesWithoutABus) {
  testing::OutsideTape tape;
  Outputs live;
  {
    testing::Loopback graph({.lockstep = false, .outside = &tape});
    auto master = can::open("embedded:arm", graph.directory());
    int cycle = 0;
    live = run(graph, [&] {  // enables drive 1 and moves it
      std::vector<can::Frame> frames;
      if (cycle == 0) frames.push_back(cia402::nmt(cia402::Nmt::start, 0));
      if (cycle == 0) frames.push_back(cia402::sdo_download(1, cia402::object::kMode, 8, 1));
      frames.push_back(cia402::rpdo(1, 1));
      cia402::append(frames.back(), cycle < 5 ? 0x06 : cycle < 10 ? 0x07 : 0x0F, 2);
      frames.push_back(cia402::sync());
      master->send(frames);
      ++cycle;
    });
  }
  v1::JointState last;
  ASSERT_TRUE(last.ParseFromString(live["joint_states"].back()));
  EXPECT_EQ(last.drives(0), v1::DRIVE_STATE_OPERATION_ENABLED);

  tape.rewind();
  testing::Loopback graph({.lockstep = false, .outside = &tape});
  EXPECT_EQ(run(graph, [] {}), live);
  EXPECT_EQ(tape.problem(), "");
  EXPECT_TRUE(tape.at_end());
  EXPECT_TRUE(std::filesystem::is_empty(graph.directory())) << "a socket was made";

  for (std::size_t i = 0; i < tape.entries().size(); ++i) {
    if (tape.entries()[i].written) tape.entries()[i].name = "hand";
  }
  tape.rewind();
  testing::Loopback other({.lockstep = false, .outside = &tape});
  run(other, [] {});
  EXPECT_EQ(tape.problem(), "entry 1: the node has written 'can', the record written 'hand'");
}

}  // namespace
}  // namespace mimesis::hw::sim
