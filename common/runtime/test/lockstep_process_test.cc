#include <gtest/gtest.h>

#include <csignal>
#include <map>
#include <sstream>

#include "common/runtime/ports.h"
#include "common/runtime/raw.h"
#include "common/testing/process.h"
#include "proto/runtime.pb.h"

namespace mimesis::runtime {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

constexpr const char* kCounter = MIMESIS_COUNTER;

struct CounterSpec {
  std::string name;
  double rate_hz, offset_s;
  std::string a, b, latest;  // topics
};

// Two loops and a slow node that hears all of them twice.
const std::vector<CounterSpec> kGraph{
    {"one", 200.0, 0.0, "two/out", "", "three/out"},
    {"two", 200.0, 0.0025, "one/out", "four/out", ""},
    {"three", 60.0, 0.0, "one/out", "two/out", "four/out"},
    {"four", 30.0, 0.0, "three/out", "one/out", "two/out"},
};

std::string names() {
  std::string list;
  for (const CounterSpec& s : kGraph) list += (list.empty() ? "" : ",") + s.name;
  return list;
}

std::unique_ptr<Process> start(const TestGraph& graph, const CounterSpec& s, int work) {
  std::ostringstream rate, offset;
  rate << "rate_hz=" << s.rate_hz;
  offset << "offset_s=" << s.offset_s;
  std::vector<std::string> arguments{
      "--name",   s.name,  "--clock",    "lockstep", "--set",
      rate.str(), "--set", offset.str(), "--set",    "work=" + std::to_string(work)};
  const auto wire = [&](const std::string& port, const std::string& topic) {
    if (!topic.empty()) arguments.insert(arguments.end(), {"--in", port + "=" + topic});
  };
  wire("a", s.a);
  wire("b", s.b);
  wire("latest", s.latest);
  return std::make_unique<Process>(graph, kCounter, arguments);
}

/// Everything published on NODE/out, in order, until all the nodes have ended.
std::map<std::string, std::string> outputs_of_a_run(int work, bool reversed) {
  TestGraph graph;
  Tap tap(
      graph.name(), [](const std::string& topic) { return topic.ends_with("/out"); },
      Policy::reliable);
  std::vector<std::unique_ptr<Process>> nodes;
  for (std::size_t i = 0; i < kGraph.size(); ++i) {
    // The load differs from node to node and from run to run.
    nodes.push_back(
        start(graph, kGraph[reversed ? kGraph.size() - 1 - i : i], work * static_cast<int>(i)));
  }
  Process clock(graph, "mimesis_clock", {"--set", "participants=" + names(), "--set", "until_s=2"});
  std::map<std::string, std::string> outputs;
  while (!clock.wait(0ms)) {
    while (const auto m = tap.next(20ms)) {
      outputs[m->topic] += std::to_string(m->message.seq) + "@" +
                           std::to_string(m->message.stamp.count()) + ":" + m->message.payload +
                           "\n";
    }
  }
  EXPECT_EQ(clock.wait(), 0) << clock.errors();
  for (auto& node : nodes) {
    EXPECT_EQ(node->wait(), 0) << node->errors();
    EXPECT_EQ(node->errors().find("did not arrive"), std::string::npos) << node->errors();
    EXPECT_EQ(node->errors().find("without a connection"), std::string::npos) << node->errors();
  }
  return outputs;
}

TEST(Lockstep, EqualRunsWhateverTheLoad) {
  const auto first = outputs_of_a_run(0, false);
  ASSERT_EQ(first.size(), kGraph.size());
  for (const CounterSpec& s : kGraph) {
    const auto& text = first.at(s.name + "/out");
    const auto lines = std::count(text.begin(), text.end(), '\n');
    EXPECT_GE(lines, static_cast<long>(2.0 * s.rate_hz))
        << s.name;  // from the first to the last, none lost
    EXPECT_TRUE(text.starts_with("1@")) << s.name;
  }
  const auto second = outputs_of_a_run(20'000, true);
  EXPECT_EQ(first, second);
}

TEST(Lockstep, TheDeadLeaveAndTheRestartedJoin) {
  TestGraph graph;
  TestNode peer(graph, {{"one", "one/out"}, {"two", "two/out"}}, {});
  Reliable<v1::Publication> one(peer.bus(), "one"), two(peer.bus(), "two");
  peer.open();
  auto first = start(graph, kGraph[0], 0);
  auto second = start(graph, kGraph[1], 0);
  Process clock(graph, "mimesis_clock", {"--set", "participants=one,two", "--set", "factor=1"});
  ASSERT_TRUE(peer.receive(two)) << second->errors();
  second->signal(SIGSTOP);  // the others wait for it
  while (peer.receive(one, 100ms)) {
  }
  second->signal(SIGKILL);
  const auto killed = TestNode::now();
  ASSERT_TRUE(peer.receive(one)) << "the barrier still waits for a dead node";
  EXPECT_LT(to_seconds(TestNode::now() - killed), 0.2);
  second = start(graph, kGraph[1], 0);
  while (peer.receive(two, 0ms)) {
  }
  const auto restarted = peer.receive(two);
  ASSERT_TRUE(restarted) << second->errors();
  ASSERT_TRUE(peer.receive(one));
  EXPECT_EQ(second->terminate(), 0);
  EXPECT_EQ(first->terminate(), 0);
  EXPECT_EQ(clock.terminate(), 0);
}

TEST(Lockstep, AStoppedSubscriberHoldsTimeUpOnce) {
  TestGraph graph;
  Process listener(graph, kCounter, {"--name", "listener", "--in", "a=one/out"});
  std::vector<std::unique_ptr<Process>> nodes;
  for (const CounterSpec& s : {CounterSpec{"one", 1000.0, 0.0, "two/out", "", ""},
                               CounterSpec{"two", 1000.0, 0.0, "one/out", "", ""}})
    nodes.push_back(start(graph, s, 0));
  TestNode peer(graph, {{"in", "one/out"}}, {});
  Latest<v1::Publication> in(peer.bus(), "in");
  peer.open();
  Process clock(graph, "mimesis_clock",
                {"--set", "participants=one,two", "--set", "until_s=20", "--set", "factor=5"});
  ASSERT_TRUE(peer.until([&] { return in.get() != nullptr && in.stamp() > 2s; }));
  listener.signal(SIGSTOP);  // it has heard the first messages
  EXPECT_EQ(clock.wait(60s), 0) << clock.errors();
  for (auto& node : nodes) {
    EXPECT_EQ(node->wait(), 0) << node->errors();
    EXPECT_EQ(node->errors().find("did not arrive"), std::string::npos) << node->errors();
  }
  EXPECT_NE(nodes[0]->errors().find("stopped by a signal"), std::string::npos)
      << nodes[0]->errors();
  EXPECT_EQ(nodes[1]->errors().find("stopped by a signal"), std::string::npos)
      << nodes[1]->errors();
  listener.signal(SIGKILL);
}

TEST(StoppedSubscriber, KeepsItsMessagesUntilOthersWait) {
  TestGraph graph;
  Process listener(graph, kCounter, {"--name", "listener", "--in", "a=sender/out"});
  TestNode sender(graph, {}, {{"out", "sender/out"}}, "sender");
  Out<v1::Publication> out(sender.bus(), "out");
  sender.open();
  ASSERT_TRUE(sender.until([&] { return out.subscribers() > 0; }));
  listener.signal(SIGSTOP);
  v1::Publication m;
  m.set_topic(std::string(10'000, 'x'));
  constexpr std::uint64_t kCount = 1000;  // more than sockets take
  for (std::uint64_t i = 1; i <= kCount; ++i) out.send(m, Time(i));
  const auto began = std::chrono::steady_clock::now();
  sender.until([&] { return std::chrono::steady_clock::now() - began > 4s; });
  EXPECT_GT(sender.bus().backlog(), 0U) << "nobody else waits";
  TestNode well(graph, {{"in", "sender/out"}}, {}, "well");
  Reliable<v1::Publication> in(well.bus(), "in");
  well.open();
  ::testing::internal::CaptureStderr();
  EXPECT_TRUE(sender.until([&] {
    well.until([] { return true; });
    out.send(m, 1s);
    return in.pop().has_value();
  }));
  const std::string said = ::testing::internal::GetCapturedStderr();
  EXPECT_NE(said.find("(mimesis_counter), stopped by a signal"), std::string::npos) << said;
  listener.signal(SIGKILL);
}

TEST(Lockstep, ARestartedConductorGoesOn) {
  TestGraph graph;
  TestNode peer(graph, {{"one", "one/out"}}, {});
  Latest<v1::Publication> one(peer.bus(), "one");
  peer.open();
  auto node = start(graph, kGraph[0], 0);
  Time before{};
  {
    Process clock(graph, "mimesis_clock", {"--set", "participants=one", "--set", "factor=1"});
    ASSERT_TRUE(peer.until([&] { return one.get() != nullptr && one.stamp() > 100ms; }))
        << node->errors();
    clock.signal(SIGKILL);
    ASSERT_TRUE(clock.wait());
    peer.until([&] { return one.take() == nullptr; });
    before = one.stamp();
  }
  Process clock(graph, "mimesis_clock", {"--set", "participants=one", "--set", "factor=1"});
  EXPECT_TRUE(peer.until([&] { return one.stamp() > before + 50ms; })) << node->errors();
  EXPECT_LT(one.stamp(), before + 1s);
}

TEST(SimTime, NodesFollowTheClockAndEndWithIt) {
  TestGraph graph;
  TestNode peer(graph, {{"out", "counter/out"}}, {});
  Reliable<v1::Publication> out(peer.bus(), "out");
  peer.open();
  Process node(graph, kCounter, {"--clock", "sim"});
  Process clock(graph, "mimesis_clock",
                {"--set", "mode=sim", "--set", "factor=4", "--set", "until_s=2", "--set",
                 "participants=counter"});
  std::uint64_t steps = 0;
  while (const auto m = peer.receive(out, steps == 0 ? 10s : 500ms)) steps = m->seq();
  EXPECT_EQ(node.wait(), 0) << node.errors();
  EXPECT_GT(steps, 50U);  // 200 at 100 Hz in 2 s, less what a loaded machine skips
  EXPECT_LT(steps, 215U);
}

}  // namespace
}  // namespace mimesis::runtime
