// Buses on which somebody else lives: nodes that are not ours, other masters.
#include <gtest/gtest.h>

#include "hw/cia402/test/joint_driver_bench.h"

namespace mimesis::hw::cia402 {
namespace {

TEST_F(Bench, LeavesABusAloneThatAnotherMasterRuns) {
  enable();
  JointDriver late({.axes = axes(), .limits = limits()}, wire.join());
  for (int k = 0; k < 500; ++k) {  // with retries
    follow(kCycle);
    const Reading& heard = late.read(now);
    late.write(now, {.mode = Mode::follow, .position_rad = target});
    ASSERT_EQ(late.counters().sent, 0u) << k;
    ASSERT_EQ(heard.phase, Phase::fault);
    ASSERT_EQ(heard.reason, "another master runs this bus: its SYNC was heard");
  }
  late.stop();
  EXPECT_EQ(late.counters().sent, 0u);
  EXPECT_EQ(reading().phase, Phase::following) << reading().reason;
  driver.reset();
  Phase phase{};
  for (int k = 0; k < 1000; ++k) {
    phase = late.read(now).phase;
    late.write(now, {.mode = Mode::idle});
    idle(kCycle);
  }
  EXPECT_EQ(phase, Phase::idle) << late.reading().reason;
}

/// A master that has not sent SYNC yet is known by its heartbeat.
TEST_F(Bench, LeavesABusAloneOnWhichAnotherMasterLives) {
  plug();
  connect();
  for (int k = 0; k < 100; ++k) {
    if (k % 20 == 0) tap->send(std::array{heartbeat(kMasterNode, NmtState::operational)});
    idle(kCycle);
  }
  EXPECT_EQ(driver->counters().sent, 0u);
  EXPECT_EQ(reading().reason, "another master runs this bus: its heartbeat (node 127) was heard");
  idle(3s);
  EXPECT_EQ(reading().phase, Phase::idle) << "it has gone: " << reading().reason;
}

/// A node of somebody else, which its own master has started, goes on through start, motion, fault,
/// halt, reset and stop of ours. On a bus of its own the bridge halts all nodes by one frame.
TEST_F(Bench, NeverTouchesANodeThatIsNotOurs) {
  for (const bool exclusive : {false, true}) {
    plug();
    sim::Rack foreign({{.axis = {.node_id = 40}}}, wire.join());
    foreign.step(now);
    tap->send(std::array{nmt(Nmt::start, 40)});
    foreign.step(now);
    driver.emplace(JointDriverOptions{.axes = axes(), .limits = limits(), .exclusive = exclusive},
                   wire.join());
    seen();
    idle(500ms);
    follow(100ms);
    ASSERT_EQ(reading().phase, Phase::following) << reading().reason;
    rack->drives()[1].inject(sim::Trouble::overcurrent);
    follow(50ms);
    ASSERT_EQ(reading().phase, Phase::fault);
    EXPECT_EQ(driver->reset_faults(), "");
    idle(300ms);
    ASSERT_EQ(reading().phase, Phase::idle) << reading().reason;
    follow(100ms);
    rack->drives()[2].inject(sim::Trouble::mute, 300ms);
    follow(300ms);
    idle(3s);
    follow(100ms);
    ASSERT_EQ(reading().phase, Phase::following) << reading().reason;
    driver->stop();
    driver.reset();
    int told = 0, all = 0;
    for (const can::Frame& f : seen()) {
      if (f.id != 0) continue;
      ++told;
      all += f.data[1] == 0;
      EXPECT_TRUE(f.data[1] != 0 || (exclusive && f.data[0] == 2)) << can::frame_text(f);
      EXPECT_NE(f.data[1], 40);
    }
    EXPECT_GT(told, 3 * kAxes);
    EXPECT_EQ(all > 0, exclusive);
  }
}

TEST_F(Bench, TouchesNoForeignNodeInAThousandStarts) {
  plug();
  std::size_t told = 0;
  for (int k = 0; k < 1000; ++k) {  // each ends somewhere: listening, set-up, motion, fault
    connect();
    idle(Time(150ms) + (k % 23) * 20ms);
    follow((k % 5) * 20ms);
    if (k % 3 == 0) rack->drives()[0].inject(sim::Trouble::overcurrent);
    if (k % 7 == 0) rack->drives()[2].inject(sim::Trouble::mute, 20ms);
    follow(20ms);
    driver->stop();
    driver.reset();
    for (const can::Frame& f : seen()) {
      if (f.id != 0) continue;
      ++told;
      ASSERT_TRUE(f.data[1] == 1 || f.data[1] == 5 || f.data[1] == 9) << can::frame_text(f);
    }
  }
  EXPECT_GT(told, 5000u);
}

TEST_F(Bench, StopsItsDrivesIfAnotherMasterComes) {
  enable();
  tap->send(std::array{sync()});
  follow(2 * kCycle);
  EXPECT_EQ(reading().phase, Phase::fault);
  EXPECT_EQ(reading().reason, "another master runs this bus: its SYNC was heard");
  idle(500ms);
  EXPECT_FALSE(any_enabled());
  rack->drives()[1].inject(sim::Trouble::mute);  // it is searched: the others still hear of it
  idle(500ms);
  tap->send(std::array{sync()});
  idle(kCycle);
  const auto sent = driver->counters().sent;
  idle(100ms);
  EXPECT_GT(driver->counters().sent, sent);
}

}  // namespace
}  // namespace mimesis::hw::cia402
