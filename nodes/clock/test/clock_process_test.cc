#include <gtest/gtest.h>

#include "common/runtime/ports.h"
#include "common/runtime/sockets.h"
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

/// A node of the lock-step, packet by packet.
struct Member {
  Member(const TestGraph& graph, const std::string& name, std::uint64_t start_id)
      : socket(runtime::PacketSocket::connect(graph.directory() + "/clock.sock")) {
    v1::LockstepJoin join;
    join.set_node(name);
    join.set_start_id(start_id);
    join.set_rate_hz(100.0);
    EXPECT_TRUE(socket.send(join.SerializeAsString()));
  }
  /// Time of the next step, reported as done; nothing without one within 10 s.
  std::optional<std::uint64_t> step(std::uint64_t next_in_ns = 0) {
    std::string packet;
    v1::StepGo go;
    v1::StepReport report;
    report.set_step(1);
    const auto deadline = std::chrono::steady_clock::now() + 10s;
    while (std::chrono::steady_clock::now() < deadline) {
      const auto result = socket.receive(packet);
      if (result == runtime::PacketSocket::Result::closed) return std::nullopt;
      if (result != runtime::PacketSocket::Result::packet || !go.ParseFromString(packet)) continue;
      if (next_in_ns > 0) report.set_next_ns(go.time_ns() + next_in_ns);
      if (socket.send(report.SerializeAsString())) return go.time_ns();
    }
    return std::nullopt;
  }
  runtime::PacketSocket socket;
};

TEST(ClockProcess, LeavesOutANodeThatNeverReports) {
  TestGraph graph;
  Process clock(graph, "mimesis_clock",
                {"--set", "participants=mute,well", "--set", "patience_s=0.3"});
  ASSERT_TRUE(clock.wait_ready(graph, "clock")) << clock.errors();
  const Member mute(graph, "mute", 7);
  Member well(graph, "well", 8);
  for (std::uint64_t k = 0; k < 5; ++k) EXPECT_EQ(well.step(), k * 10'000'000);
  EXPECT_NE(clock.errors().find("node mute: its step at 0 s has not ended for "), std::string::npos)
      << clock.errors();
  EXPECT_EQ(clock.terminate(), 0);
}

TEST(ClockProcess, NamesANodeThatStepsTooFast) {
  TestGraph graph;
  Process clock(graph, "mimesis_clock", {});
  ASSERT_TRUE(clock.wait_ready(graph, "clock")) << clock.errors();
  Member hasty(graph, "hasty", 7);
  std::optional<std::uint64_t> time;
  for (int k = 0; k < 10'200; ++k) time = hasty.step(1);
  EXPECT_GT(time, 1'000'000);
  EXPECT_EQ(clock.terminate(), 0);
  const std::string said = clock.errors(), line = "node hasty asks for steps";
  const std::size_t at = said.find(line);
  ASSERT_NE(at, std::string::npos) << said;
  EXPECT_EQ(said.find(line, at + 1), std::string::npos) << "said twice: " << said;
}

TEST(ClockProcess, GivesNobodyThePlaceOfAnother) {
  TestGraph graph;
  Process clock(graph, "mimesis_clock", {});
  ASSERT_TRUE(clock.wait_ready(graph, "clock")) << clock.errors();
  Member well(graph, "well", 8);
  ASSERT_TRUE(well.step());
  {
    Member thief(graph, "thief", 8);
    EXPECT_FALSE(thief.step());
  }
  for (int k = 0; k < 5; ++k) EXPECT_TRUE(well.step());
  EXPECT_NE(clock.errors().find("node thief may not join: a node with its name or start id"),
            std::string::npos)
      << clock.errors();
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
