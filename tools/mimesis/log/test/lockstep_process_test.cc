// Equal runs in lock-step give equal logs, and a log gives the same run again.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <csignal>

#include "common/log/indexed_reader.h"
#include "common/runtime/own_topics.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "proto/runtime.pb.h"

namespace mimesis::tool {
namespace {

using testing::Process;
using testing::TestGraph;
using namespace std::chrono_literals;

struct Line {
  std::string topic;
  std::uint64_t log_time, sequence;
  std::string data;
  bool operator==(const Line&) const = default;
};

/// Topics about a node's own process: they differ from run to run.
bool about_process(std::string_view topic) {
  return runtime::is_own_topic(topic) || topic.starts_with("clock/");
}

/// The messages of `file` in its order, those about processes left out.
std::vector<Line> lines(const std::string& file, const std::string& topic = "") {
  std::vector<Line> all;
  const auto source = log::open_file(file);
  if (!source) return all;
  log::StreamReader reader(**source);
  while (const log::Record* record = reader.next()) {
    const auto* m = std::get_if<log::Message>(record);
    if (m == nullptr) continue;
    const std::string& name = reader.channels().at(m->channel_id).topic;
    if (about_process(name)) continue;
    if (topic.empty() || name == topic) {
      all.push_back({name, m->log_time, m->sequence, std::string(m->data)});
    }
  }
  EXPECT_EQ(reader.damage_count(), 0U);
  return all;
}

class LogLockstep : public ::testing::Test {
 protected:
  /// Two seconds of node b, fed by node a, or by the player of `log`; returns the log of it.
  std::string run(const std::string& name, const std::string& log) {
    const TestGraph graph;
    setenv("MIMESIS_GRAPH", graph.name().c_str(), 1);
    const std::string file = (folder_ / name).string();
    Process recorder("mimesis", {"log", "record", "--all", "--output", file});
    EXPECT_TRUE(recorder.wait_ready(graph, "tap-" + std::to_string(recorder.pid()) + "-1"))
        << recorder.errors();
    Process clock(graph, "mimesis_clock",
                  {"--set", "mode=lockstep", "--set", "until_s=2", "--set", "participants=a,b"});
    const auto a = sender(graph, log);
    const auto b = listener(graph);
    EXPECT_EQ(clock.wait(30s), 0) << clock.errors();
    EXPECT_EQ(a->wait(), 0) << a->errors();
    EXPECT_EQ(b->wait(), 0) << b->errors();
    recorder.signal(SIGINT);
    EXPECT_EQ(recorder.wait(), 0) << recorder.errors();
    return file;
  }

  /// b looks 0.2 ms after a has spoken, or is to have spoken, and 0.8 ms later.
  static std::unique_ptr<Process> sender(const TestGraph& graph, const std::string& log) {
    if (log.empty()) {
      return std::make_unique<Process>(
          graph, MIMESIS_COUNTER,
          std::vector<std::string>{"--name", "a", "--clock", "lockstep", "--set",
                                   "offset_s=0.0003"});
    }
    return std::make_unique<Process>(
        "mimesis", std::vector<std::string>{"log", "play", log, "--lockstep", "--name", "a",
                                            "--topic", "a/out"});
  }
  static std::unique_ptr<Process> listener(const TestGraph& graph) {
    return std::make_unique<Process>(
        graph, MIMESIS_COUNTER,
        std::vector<std::string>{"--name", "b", "--clock", "lockstep", "--in", "a=a/out", "--set",
                                 "rate_hz=1000", "--set", "offset_s=0.0005"});
  }

  testing::TemporaryFolder folder_;
};

TEST_F(LogLockstep, EqualRunsGiveEqualLogsAndAReplayTheSameSteps) {
  const std::string first = run("first.mcap", "");
  const std::vector<Line> recorded = lines(first);
  ASSERT_GE(recorded.size(), 2190U);  // 100 Hz and 1 kHz
  EXPECT_TRUE(lines(run("second.mcap", "")) == recorded);

  // Each message of b is a hash of all it has seen and when.
  const std::vector<Line> steps = lines(first, "b/out");
  EXPECT_GE(steps.size(), 1990U);
  EXPECT_TRUE(lines(run("replay.mcap", first), "b/out") == steps);
}

TEST_F(LogLockstep, ThePlayerLeavesAtTheEndAndTimeGoesOn) {
  const std::string log = run("run.mcap", "");
  const TestGraph graph;
  setenv("MIMESIS_GRAPH", graph.name().c_str(), 1);
  Process clock(graph, "mimesis_clock", {"--set", "mode=lockstep", "--set", "participants=a,b"});
  const auto player = sender(graph, log);
  const auto b = listener(graph);
  EXPECT_EQ(player->wait(60s), 0) << player->errors();
  EXPECT_NE(player->errors().find("200 messages played\n"), std::string::npos) << player->errors();
  testing::TestNode node(graph, {{"out", "b/out"}}, {});
  runtime::Reliable<v1::Publication> out(node.bus(), "out");
  node.open();
  const auto m = node.receive(out);  // it steps without the player
  ASSERT_TRUE(m);
  EXPECT_GT(m->seq(), 2000U);
  EXPECT_EQ(b->terminate(), 0);
  EXPECT_EQ(clock.terminate(), 0);
}

}  // namespace
}  // namespace mimesis::tool
