#include <gtest/gtest.h>

#include "common/runtime/ports.h"
#include "common/testing/process.h"
#include "proto/runtime.pb.h"

namespace mimesis::clock {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

TEST(ClockProcess, SimulatedTimeRunsAtItsFactorAndEnds) {
  TestGraph graph;
  TestNode peer(graph, {{"time", "clock/time"}}, {});
  runtime::Reliable<v1::ClockTime> time(peer.bus(), "time");
  peer.open();
  Process clock(graph, "mimesis_clock",
                {"--set", "mode=sim", "--set", "factor=5", "--set", "until_s=2"});
  std::optional<v1::ClockTime> m, last;
  while ((m = peer.receive(time))) {
    last = m;
    EXPECT_EQ(m->factor(), 5.0);
    if (m->ended()) break;
  }
  ASSERT_TRUE(last) << clock.errors();
  EXPECT_TRUE(last->ended());
  EXPECT_NEAR(1e-9 * static_cast<double>(last->time_ns()), 2.0, 0.5);
  EXPECT_EQ(clock.wait(), 0);
}

TEST(ClockProcess, ALateJoinerHearsTheTime) {
  TestGraph graph;
  Process clock(graph, "mimesis_clock", {"--set", "mode=sim", "--set", "factor=1"});
  ASSERT_TRUE(clock.wait_ready(graph, "clock")) << clock.errors();
  TestNode peer(graph, {{"time", "clock/time"}}, {});
  runtime::Latest<v1::ClockTime> time(peer.bus(), "time");
  peer.open();
  EXPECT_TRUE(peer.until([&] { return time.get() != nullptr; }));
  EXPECT_EQ(clock.terminate(), 0);
}

TEST(ClockProcess, RefusesToRunFreeWithoutAPace) {
  TestGraph graph;
  Process clock(graph, "mimesis_clock", {"--set", "mode=sim"});
  EXPECT_EQ(clock.wait(), 2);
  EXPECT_NE(clock.errors().find("clock.factor"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::clock
