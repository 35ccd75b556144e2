#include <gtest/gtest.h>

#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/far_host.h"
#include "tools/mimesis/launch/graph_file.h"
#include "tools/mimesis/launch/supervisor.h"
#include "tools/mimesis/launch/test/graph_text.h"

namespace mimesis::launch {
namespace {
using namespace std::chrono_literals;
using Groups = std::vector<std::vector<std::string>>;

TEST(StopOrder, ReverseOfTheStartWithLastAtTheEnd) {
  const GraphFile g = read_text(
      "version: 1\nnodes:\n  drives: {exec: x}\n  bridge: {exec: x, after: [drives], stop: {order: "
      "last}}\n"
      "  world: {exec: x}\n  planner: {exec: x, after: [bridge, world]}\n  camera: {exec: x, "
      "after: [planner]}\n");
  // The drives must outlive the bridge, which is to be stopped last.
  EXPECT_EQ(stop_order(g), (Groups{{"camera"}, {"planner"}, {"world"}, {"bridge"}, {"drives"}}));
}

TEST(Order, NobodyWaitsForADisabledNode) {
  const GraphFile g =
      read_text("version: 1\nnodes: {a: {exec: x, if: false}, b: {exec: x, after: [a]}}\n");
  ASSERT_EQ(g.nodes.size(), 1U);
  EXPECT_TRUE(g.nodes[0].after.empty());
}

TEST(WithClock, ComesFirstAndKnowsWhoTakesPart) {
  const GraphFile g =
      with_clock(read_text("version: 1\nclock: lockstep\nnodes:\n  rec: {exec: mimesis}\n  sh: "
                           "{exec: sh, ready: started}\n"
                           "  a: {exec: x}\n  b: {exec: x}\n"));
  ASSERT_EQ(g.nodes.size(), 5U);
  EXPECT_EQ(g.nodes[0].name.text, "clock");
  EXPECT_EQ(g.nodes[0].args.back().text, "participants=a,b");
  EXPECT_TRUE(g.find("rec")->after.empty());
  EXPECT_EQ(g.find("a")->after.at(0).text, "clock");
  EXPECT_EQ(stop_order(g).back(), (std::vector<std::string>{"clock"}));
  EXPECT_EQ(with_clock(read_text("version: 1\nnodes: {a: {exec: x}}\n")).nodes.size(), 1U);
}

TEST(Command, SaysAllThatANodeNeeds) {
  const GraphFile g = read_text(
      "version: 1\nargs: {t: {default: a b}}\nnodes:\n  eye: {exec: /bin/true, args: [-v], env: "
      "{K: v}, "
      "in: {i: t/i}, out: {o: t/o}}\n");
  const launch::Run run{
      .graph = "g1", .log = "/log", .sets = {{"eye", "rate_hz=3"}, {"arm", "x=1"}}};
  const Command c = command(g, g.nodes[0], run);
  const std::vector<std::string> expected = {
      "/bin/true", "-v",      "--name", "eye",       "--graph",
      "g1",        "--clock", "wall",   "--params",  g.file + "#nodes.eye.params",
      "--arg",     "t=a b",   "--set",  "rate_hz=3", "--in",
      "i=t/i",     "--out",   "o=t/o"};
  EXPECT_EQ(c.argv, expected);
  EXPECT_EQ(c.env.at(0), (std::pair<std::string, std::string>{"K", "v"}));
  EXPECT_NE(shell_line(c).find("--arg 't=a b'"), std::string::npos);
}

TEST(Command, GoesThroughSshToOtherHosts) {
  const GraphFile g = read_text(
      "version: 1\nhosts: {spine: {address: biped, user: robot, prefix: /opt/m}}\n"
      "nodes: {a: {exec: mimesis_x, host: spine}}\n");
  const Command c = command_from_here(g, g.nodes[0], {.graph = "g1", .log = "/log", .sets = {}});
  EXPECT_EQ(c.argv.at(0), "ssh");
  EXPECT_EQ(c.argv.at(6), "robot@biped");
  EXPECT_TRUE(c.argv.back().starts_with(
      "exec env MIMESIS_GRAPH=g1 MIMESIS_RUN_LOG=/log /opt/m/bin/mimesis_x "))
      << c.argv.back();
}

TEST(Command, NodesOfSeveralHostsAreBoundToTcp) {
  const GraphFile g = read_text(
      "version: 1\nhosts: {spine: {address: 10.9.9.9, first_port: 7400}, here: {address: "
      "localhost}}\n"
      "nodes: {a: {exec: x}, b: {exec: x, host: spine}, c: {exec: x, host: here}, d: {exec: x, "
      "host: "
      "spine}}\n");
  std::vector<std::string> bound;
  for (const NodeSpec& node : g.nodes) bound.push_back(bind_address(g, node));
  EXPECT_EQ(bound, (std::vector<std::string>{"tcp://0.0.0.0:*", "tcp://10.9.9.9:7400",
                                             "tcp://0.0.0.0:*", "tcp://10.9.9.9:7403"}));
  EXPECT_EQ(bind_address(read_text("version: 1\nnodes: {a: {exec: x}}\n"), g.nodes[0]), "");
}

TEST(ClockOffset, TheShortestWayCounts) {
  ClockOffset offset;  // there: 5 s less than the graph's time
  offset.add(Time(10s), Time(5s + 9ms), Time(5s + 9ms), Time(10s + 10ms));  // slow on the way there
  EXPECT_EQ(offset.best().graph_minus_there, Time(5s - 4ms));
  offset.add(Time(11s), Time(6s + 1ms), Time(6s + 3ms), Time(11s + 4ms));
  EXPECT_EQ(offset.best().graph_minus_there, Time(5s));
  EXPECT_EQ(offset.best().delay, Time(2ms));
  for (int i = 0; i < 16; ++i) offset.add(Time(12s), Time(8s), Time(8s), Time(12s + 6ms));
  EXPECT_EQ(offset.best().graph_minus_there, Time(4s + 3ms)) << "old ones are forgotten";
}

TEST(Backoff, GrowsAndGivesUpAndForgets) {
  Backoff backoff({.on_failure = true, .delay = 100ms, .backoff = 2.0, .max = 3, .window = 10s});
  const WallTime t0{};
  EXPECT_EQ(backoff.next(t0), t0 + 100ms);
  EXPECT_EQ(backoff.next(t0 + 1s), t0 + 1s + 200ms);
  EXPECT_EQ(backoff.next(t0 + 2s), t0 + 2s + 400ms);
  EXPECT_FALSE(backoff.next(t0 + 3s));
  EXPECT_EQ(backoff.next(t0 + 10500ms), t0 + 10500ms + 400ms);  // the first has left the window
  EXPECT_FALSE(Backoff({}).next(t0));
}

}  // namespace
}  // namespace mimesis::launch
