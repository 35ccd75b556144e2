// `mimesis log replay` of real nodes: two counters that hear each other.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <csignal>
#include <filesystem>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "common/log/writer.h"
#include "common/machine_time.h"
#include "common/runtime/raw.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "proto/steps.pb.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::Process;
using testing::TestGraph;
using testing::TestNode;
namespace fs = std::filesystem;

constexpr const char* kCounter = MIMESIS_COUNTER;
constexpr std::uint64_t kSteps = 50;  // least number of steps of node `a`

bool has_recorder(const TestGraph& graph) {
  for (const auto& node : runtime::GraphView(graph.name()).nodes()) {
    for (const auto& input : node.inputs()) {
      if (input.topic() == "*") return true;
    }
  }
  return false;
}

/// Counters `a` (100 Hz) and `b` (50 Hz) with a recorder.
class RecordedCounters {
 public:
  RecordedCounters(const std::string& clock, const std::string& log,
                   const std::vector<std::string>& options_of_a = {})
      : clock_(clock) {
    setenv("MIMESIS_GRAPH", graph_.name().c_str(), 1);  // the recorder has no option for it
    recorder_ = std::make_unique<Process>(
        "mimesis", std::vector<std::string>{"log", "record", "--all", "-o", log});
    MachineTime time;
    runtime::GraphView view(graph_.name());
    while (!has_recorder(graph_) && time.passed() < 10s) view.wait(100ms);
    if (clock != "wall") {
      conductor_ = std::make_unique<Process>(
          graph_, "mimesis_clock",
          std::vector<std::string>{"--set", "mode=" + clock, "--set", "participants=a,b", "--set",
                                   "factor=1"});
    }
    start_a(options_of_a);
    b_ = std::make_unique<Process>(
        graph_, kCounter,
        std::vector<std::string>{"--name", "b", "--clock", clock, "--in", "b=a/out", "--set",
                                 "rate_hz=50", "--set", "offset_s=0.0025"});
  }

  void start_a(const std::vector<std::string>& options = {}) {
    std::vector<std::string> words{"--name", "a",       "--clock", clock_,
                                   "--in",   "a=b/out", "--in",    "latest=b/out"};
    words.insert(words.end(), options.begin(), options.end());
    a_ = std::make_unique<Process>(graph_, kCounter, words);
  }

  /// Until `node` has published `count` messages from now on.
  bool run(const std::string& node = "a", std::uint64_t count = kSteps) {
    runtime::Tap tap(
        graph_.name(), [&](const std::string& topic) { return topic == node + "/out"; },
        runtime::Policy::latest);
    MachineTime time;
    std::optional<std::uint64_t> first;
    while (time.passed() < 20s) {
      const auto m = tap.next(100ms);
      if (!m) continue;
      if (!first) first = m->message.seq;
      if (m->message.seq >= *first + count) return true;
    }
    return false;
  }

  Process& a() { return *a_; }
  TestGraph& graph() { return graph_; }

  void stop() {
    if (!a_->wait(0ms)) {
      EXPECT_EQ(a_->terminate(), 0) << a_->errors();
    }
    EXPECT_EQ(b_->terminate(), 0) << b_->errors();
    if (conductor_) {
      EXPECT_EQ(conductor_->terminate(), 0);
    }
    EXPECT_EQ(recorder_->terminate(), 0) << recorder_->errors();
  }

 private:
  TestGraph graph_;
  std::string clock_;
  std::unique_ptr<Process> recorder_, conductor_, a_, b_;
};

/// Writes a copy of a log without the messages for which `keep` is false; it may change the
/// payload.
void copy_log(const std::string& from, const std::string& to,
              const std::function<bool(const log::Channel& channel, std::uint32_t seq,
                                       std::string& payload)>& keep) {
  const auto logs = open_logs({from});
  const auto sink = log::create_file(to);
  ASSERT_TRUE(sink);
  log::Writer writer(**sink, {});
  std::map<std::uint16_t, std::uint16_t> channels;
  auto reader = merged(logs);
  while (const auto* item = reader.next()) {
    std::string payload(item->message->data);
    if (!keep(*item->channel, item->message->sequence, payload)) continue;
    std::uint16_t& id = channels[item->channel->id];
    if (id == 0) {
      const auto schema =
          writer.add_schema(item->schema->name, item->schema->encoding, item->schema->data);
      id = *writer.add_channel(*schema, item->channel->topic, "protobuf", item->channel->metadata);
    }
    log::Message message = *item->message;
    message.channel_id = id;
    message.data = payload;
    ASSERT_TRUE(writer.write(message));
  }
  ASSERT_TRUE(writer.finish());
}

class Replay : public testing::VerbTest {
 protected:
  static void SetUpTestSuite() {
    log_ = path("run.mcap");
    RecordedCounters run("lockstep", log_);
    ASSERT_TRUE(run.run());
    run.stop();
  }
  static std::string path(const std::string& name) { return folder_ / name; }

  int replay(std::vector<std::string> words) {
    words.insert(words.begin(), {"log", "replay", "--exec", kCounter});
    return call(words);
  }
  /// Last line of the output.
  json result() const {
    std::istringstream lines(output_);
    std::string line, last;
    while (std::getline(lines, line)) last = line;
    return json::parse(last, nullptr, false);
  }
  bool says(const std::string& text) const {
    return (output_ + errors_).find(text) != std::string::npos;
  }

  static inline testing::TemporaryFolder folder_;
  static inline std::string log_;
};

TEST_F(Replay, EveryNodeIsEqualEveryTime) {
  EXPECT_EQ(replay({log_, "--repeat", "3", "--json"}), 0) << output_ << errors_;
  std::istringstream lines(output_);
  int nodes = 0;
  for (std::string line; std::getline(lines, line); ++nodes) {
    const json node = json::parse(line);
    EXPECT_EQ(node["node"], nodes == 0 ? "a" : "b");
    EXPECT_EQ(node["result"], "equal");
    EXPECT_EQ(node["clock"], "lockstep");
    EXPECT_EQ(node["runs"], 3);
    EXPECT_EQ(node["equal"], 3);
    // Each step publishes one message; the constructor and the stop publish none.
    EXPECT_EQ(node["outputs"].get<int>(), node["steps"].get<int>() - 2);
    EXPECT_GE(node["outputs"].get<int>(), nodes == 0 ? 50 : 25);
    // `a` takes every message of b twice, except the last one.
    EXPECT_GT(node["inputs"].get<int>(), 40);
    EXPECT_EQ(node["notes"], json::array());
    EXPECT_EQ(node["problem"], "");
  }
  EXPECT_EQ(nodes, 2);
}

TEST_F(Replay, OnTheWallClockAndInSimulatedTime) {
  for (const std::string clock : {"wall", "sim"}) {
    const std::string log = path(clock + ".mcap");
    {
      RecordedCounters run(clock, log);
      ASSERT_TRUE(run.run()) << run.a().errors();
      TestNode peer(run.graph(), {}, {});
      peer.open();
      v1::Publication request;
      request.set_seq(41);
      for (const std::string& bytes : {request.SerializeAsString(), std::string("\xff")}) {
        const auto answer = peer.bus().call("a/add_one", bytes, 5s);
        EXPECT_EQ(answer.has_value(), bytes.size() > 1);
      }
      run.stop();
    }
    EXPECT_EQ(replay({"a", log, "--json"}), 0) << output_ << errors_;
    EXPECT_EQ(result()["result"], "equal");
    EXPECT_EQ(result()["clock"], clock);
    EXPECT_EQ(result()["responses"], 2);
    EXPECT_EQ(replay({"b", log}), 0) << output_ << errors_;
    EXPECT_TRUE(says("b: equal: ")) << output_;
  }
}

TEST_F(Replay, AParameterSetAtRunTimeIsSetAgainAtTheSameStep) {
  const std::string log = path("set.mcap");
  {
    RecordedCounters run("lockstep", log);
    ASSERT_TRUE(run.run()) << run.a().errors();
    Process set("mimesis", {"param", "set", "a", "salt", "5"});
    EXPECT_EQ(set.wait(), 0) << set.errors();
    Process refused("mimesis", {"param", "set", "a", "salt", "-5"});
    EXPECT_EQ(refused.wait(), 2) << refused.errors();
    ASSERT_TRUE(run.run()) << run.a().errors();
    run.stop();
  }
  EXPECT_EQ(replay({"a", log, "--json"}), 0) << output_ << errors_;
  EXPECT_EQ(result()["result"], "equal");
  EXPECT_GE(result()["responses"], 3);  // asked before, set, refused
  // The change matters: without it the outputs are others from there on.
  Process said("mimesis", {"log", "cat", log, "--topic", "a/log"});
  EXPECT_EQ(said.wait(), 0);
  EXPECT_NE(said.output().find("parameter salt: 5 instead of 0"), std::string::npos)
      << said.output();
}

TEST_F(Replay, AChangedParameterIsShownWhereItFirstMatters) {
  EXPECT_EQ(replay({"a", log_, "--set", "salt=7"}), 1);
  EXPECT_TRUE(says("a: step 1 at 0.000000 s: a/out #1 differs in 1 field\n")) << output_;
  EXPECT_TRUE(says("  start_id")) << output_;
  EXPECT_TRUE(says("a: different: 2 steps")) << output_;

  EXPECT_EQ(replay({"a", log_, "--set", "salt=7", "--keep-going=5", "--json"}), 1);
  ASSERT_EQ(result()["differences"].size(), 5U);
  EXPECT_EQ(result()["steps"], 6);
  const json third = result()["differences"][2];
  EXPECT_EQ(third["step"], 3);
  EXPECT_EQ(third["topic"], "a/out");
  EXPECT_EQ(third["seq"], 3);
  EXPECT_EQ(third["field_count"], 1);
  EXPECT_EQ(third["fields"][0]["field"], "start_id");
  EXPECT_NE(third["fields"][0]["recorded"], third["fields"][0]["replayed"]);

  EXPECT_EQ(replay({"a", log_, "--set", "salt=7", "--keep-going", "--json"}), 1);
  EXPECT_EQ(result()["difference_count"], result()["outputs"]);
}

TEST_F(Replay, WhatTheNodeRefusesIsAMistakeOfTheUser) {
  EXPECT_EQ(replay({"a", log_, "--set", "slat=7"}), 2);
  EXPECT_TRUE(says("did you mean 'salt'?")) << errors_;
  EXPECT_EQ(replay({log_, "--set", "salt=7"}), 2) << "for which node?";
  EXPECT_EQ(replay({"a", log_, "--set", "mode=refuse"}), 1);
  EXPECT_TRUE(says("counter.mode: refuses")) << output_;
}

TEST_F(Replay, AnAlteredRecordingIsFoundWhereItWasAltered) {
  const std::string altered = path("altered.mcap");
  copy_log(log_, altered, [](const log::Channel& channel, std::uint32_t seq, std::string& payload) {
    if (channel.topic == "a/out" && seq == 20) {
      v1::Publication m;
      m.ParseFromString(payload);
      m.set_start_id(1);
      payload = m.SerializeAsString();
    }
    return true;
  });
  EXPECT_EQ(replay({"a", altered}), 1);
  EXPECT_TRUE(says("a: step 20 at 0.190000 s: a/out #20 differs in 1 field\n")) << output_;
  EXPECT_TRUE(says("  start_id  1  ")) << output_;
  EXPECT_EQ(replay({"b", altered}), 1) << "it took another message than the recorded b";
}

TEST_F(Replay, AnOutputTooManyIsNamed) {
  const std::string altered = path("count.mcap");
  copy_log(log_, altered, [](const log::Channel& channel, std::uint32_t, std::string& payload) {
    v1::StepLog steps;
    if (channel.topic != "a/steps" || !steps.ParseFromString(payload)) return true;
    for (v1::StepRecord& step : *steps.mutable_steps()) {
      if (step.time_ns() == 300'000'000) step.set_published(2);
    }
    payload = steps.SerializeAsString();
    return true;
  });
  EXPECT_EQ(replay({"a", altered}), 1);
  EXPECT_TRUE(
      says("a: step 31 at 0.300000 s: the recorded step published 2 messages, the replayed "
           "one 1 (1 on a/out)"))
      << output_;
}

TEST_F(Replay, AMissingInputIsNamed) {
  const std::string filtered = path("filtered.mcap"), lossy = path("lossy.mcap");
  copy_log(log_, filtered,
           [](const auto& channel, auto, auto&) { return channel.topic != "b/out"; });
  EXPECT_EQ(replay({"a", filtered}), 1);
  EXPECT_TRUE(says("took b/out #1 of node 'b' on input 'a': the log does not hold this topic"))
      << output_;
  copy_log(log_, lossy, [](const auto& channel, std::uint32_t seq, auto&) {
    return channel.topic != "b/out" || seq != 11;
  });
  EXPECT_EQ(replay({"a", lossy}), 1);
  EXPECT_TRUE(says("took b/out #11 of node 'b' on input 'a': the message is not in the log: lost"))
      << output_;
  EXPECT_TRUE(says("a: incomplete: ")) << output_;
}

TEST_F(Replay, OutputsThatWereLeftOutAreNotComparedAndThatIsSaid) {
  const std::string filtered = path("no_outputs.mcap");
  copy_log(log_, filtered,
           [](const auto& channel, auto, auto&) { return channel.topic != "a/out"; });
  EXPECT_EQ(replay({"a", filtered}), 0) << output_;
  EXPECT_TRUE(says("a/out is not in the log: ")) << output_;
  const std::string lossy = path("lossy_outputs.mcap");
  copy_log(log_, lossy, [](const auto& channel, std::uint32_t seq, auto&) {
    return channel.topic != "a/out" || seq != 11;
  });
  EXPECT_EQ(replay({"a", lossy}), 1);
  EXPECT_TRUE(says("1 message on a/out is not in the log: lost")) << output_;
}

TEST_F(Replay, MissingStepsAreNamed) {
  const auto without = [this](const std::string& name, std::uint32_t first, std::uint32_t last) {
    copy_log(log_, path(name), [&](const log::Channel& channel, std::uint32_t seq, auto&) {
      return channel.topic != "a/steps" || seq < first || seq > last;
    });
  };
  without("late.mcap", 1, 1);
  EXPECT_EQ(replay({"a", path("late.mcap")}), 1);
  EXPECT_TRUE(says("the log was begun after the node")) << output_;
  without("gap.mcap", 3, 3);
  EXPECT_EQ(replay({"a", path("gap.mcap")}), 1);
  EXPECT_TRUE(says("are not in the log: lost")) << output_;
  without("none.mcap", 1, 1000);
  EXPECT_EQ(replay({"a", path("none.mcap")}), 1);
  EXPECT_TRUE(says("there is no message on a/steps in the log")) << output_;
}

TEST_F(Replay, AKilledNodeIsReplayedAsFarAsItsLogGoes) {
  const std::string log = path("killed.mcap");
  {
    RecordedCounters run("lockstep", log);
    ASSERT_TRUE(run.run());
    run.a().signal(SIGKILL);
    ASSERT_TRUE(run.a().wait());
    run.start_a();
    ASSERT_TRUE(run.run());
    run.stop();
  }
  EXPECT_EQ(replay({"a", log, "--json"}), 0) << output_;
  std::istringstream lines(output_);
  std::string first, second;
  std::getline(lines, first);
  std::getline(lines, second);
  const json killed = json::parse(first), restarted = json::parse(second);
  EXPECT_EQ(killed["result"], "equal");
  EXPECT_GE(killed["steps"], 30);  // 0.1 s are lost at most
  ASSERT_EQ(killed["notes"].size(), 1U);
  EXPECT_NE(killed["notes"][0].get<std::string>().find("killed"), std::string::npos);
  EXPECT_EQ(restarted["result"], "equal");
  EXPECT_NE(restarted["start_id"], killed["start_id"]);
  EXPECT_EQ(restarted["notes"], json::array());
}

TEST_F(Replay, AStepThatFailedFailsAgain) {
  const std::string log = path("failed.mcap");
  {
    RecordedCounters run("lockstep", log, {"--set", "fail_at_step=30"});
    EXPECT_EQ(run.a().wait(), 1);
    run.stop();
  }
  EXPECT_EQ(replay({"a", log}), 0) << output_ << errors_;
  EXPECT_TRUE(says("the last step failed, as recorded: asked to fail")) << output_;
  EXPECT_EQ(replay({"a", log_, "--set", "fail_at_step=30"}), 1);
  EXPECT_TRUE(
      says("a: step 30 at 0.290000 s: the replayed step failed, the recorded one did not: "
           "asked to fail"))
      << output_;
}

TEST_F(Replay, AStepThatDoesNotEndIsGivenUp) {
  EXPECT_EQ(replay({"a", log_, "--set", "hang_at_step=30", "--timeout", "0.5"}), 3);
  EXPECT_TRUE(
      says("a: step 30: the step took longer than 0.5 s (--timeout): the node was killed\n"
           "a: timed out: 30 steps, "))
      << output_;
  EXPECT_EQ(replay({"a", log_, "--timeout", "0"}), 2);
  EXPECT_TRUE(says("expected a number above 0, found '0'")) << errors_;
}

TEST_F(Replay, TheToleranceElsewhereIsForMachinesThatComputeOtherwise) {
  EXPECT_EQ(replay({"a", log_, "--tolerance-elsewhere", "0.5"}), 0);
  EXPECT_TRUE(says("  compared exactly: recorded where it computes alike: ")) << output_;
  EXPECT_TRUE(says(", glibc ")) << output_;
  setenv("GLIBC_TUNABLES", "glibc.cpu.hwcaps=-FMA,-AVX2", 1);  // another machine
  EXPECT_EQ(replay({"a", log_, "--tolerance-elsewhere", "0.5"}), 0);
  unsetenv("GLIBC_TUNABLES");
  EXPECT_TRUE(says("  compared with tolerance 0.5: recorded on ")) << output_;
  EXPECT_TRUE(says(", no FMA, no AVX2, glibc ")) << output_;
  const std::string untold = path("untold.mcap");
  copy_log(log_, untold, [](const auto&, auto, auto&) { return true; });  // without metadata
  EXPECT_EQ(replay({"a", untold, "--tolerance-elsewhere", "0.5"}), 0);
  EXPECT_TRUE(says("compared with tolerance 0.5: recorded on an unknown machine; here: "))
      << output_;
  EXPECT_EQ(replay({"a", log_, "--tolerance-elsewhere", "1", "--tolerance", "1"}), 2);
}

TEST_F(Replay, ATruncatedLogIsReplayedAsFarAsItGoes) {
  const std::string cut = path("cut.mcap");
  fs::copy_file(log_, cut);
  const auto log = open_log(log_);
  const auto& chunks = log.summary.segments;
  fs::resize_file(cut, chunks[chunks.size() / 2].index.chunk_start_offset + 10);
  EXPECT_EQ(replay({"a", cut, "--json"}), 0) << output_;
  EXPECT_EQ(result()["result"], "equal");
  EXPECT_GT(result()["steps"], 10);
  EXPECT_EQ(result()["notes"].size(), 1U);
}

TEST_F(Replay, WhatIsNotInTheLogIsThree) {
  EXPECT_EQ(replay({"c", log_}), 3);
  EXPECT_TRUE(says("there is no node 'c' in it")) << errors_;
  EXPECT_TRUE(says("there are: a, b, clock")) << errors_;
  EXPECT_EQ(replay({"clock", log_}), 3);
  EXPECT_TRUE(says("holds no clock/start")) << errors_;
  EXPECT_EQ(replay({path("none_such.mcap")}), 3);
  const std::string old = path("old.mcap");
  copy_log(log_, old, [](const auto& channel, auto, auto&) {
    return !channel.topic.ends_with("/start") && !channel.topic.ends_with("/steps");
  });
  EXPECT_EQ(replay({old}), 3);
  EXPECT_TRUE(says("no node can be replayed")) << errors_;
  EXPECT_EQ(replay({"a"}), 2) << "no log";
}

}  // namespace
}  // namespace mimesis::tool
