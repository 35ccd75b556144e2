// `mimesis log replay LAUNCH_FILE LOG`: a graph of two counters runs again beside its log.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <csignal>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "common/machine_time.h"
#include "common/runtime/raw.h"
#include "common/testing/process.h"
#include "proto/runtime.pb.h"
#include "tools/mimesis/log/test/copy_log.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using nlohmann::json;
using testing::Process;
using testing::TestGraph;
namespace fs = std::filesystem;

/// `output`: of the recorder.
std::string graph_file(const std::string& output) {
  return std::string(R"(version: 1
clock: ${arg:clock}
args:
  log: {type: path, default: "${run:log}/run.mcap"}
  clock: {type: string, default: lockstep}
  salt: {type: int, default: 0}
nodes:
  recorder:
    exec: mimesis
    args: [log, record, --all, --output, ")") +
         output + R"("]
    stop: {order: last}
  a:
    exec: )" +
         MIMESIS_COUNTER +
         R"(
    after: [recorder]
    required: true
    params: {salt: "${arg:salt}"}
    in: {a: b/out}
  b:
    exec: )" +
         MIMESIS_COUNTER +
         R"(
    after: [recorder]
    params: {rate_hz: 50}
    in: {b: a/out}
)";
}

class ReplayLaunch : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder_ = (fs::temp_directory_path() / "mimesis-test-replay-XXXXXX").string();
    ASSERT_NE(mkdtemp(folder_.data()), nullptr);
    setenv("XDG_STATE_HOME", folder_.c_str(), 1);
    file_ = path("graph.yaml");
    log_ = path("run.mcap");
    std::ofstream(file_) << graph_file("${arg:log}");
    const TestGraph graph;
    runtime::Tap tap(
        graph.name(), [](const std::string& topic) { return topic == "a/out"; },
        runtime::Policy::latest);
    Process run("mimesis", {"launch", file_, "--arg", "log=" + log_, "--graph", graph.name()});
    MachineTime time;
    for (std::uint64_t seq = 0; seq < 60 && time.passed() < 20s;) {
      if (const auto m = tap.next(100ms)) seq = m->message.seq;
    }
    run.signal(SIGINT);
    ASSERT_EQ(run.wait(20s), 130) << run.errors();
  }
  static void TearDownTestSuite() { fs::remove_all(folder_); }
  static std::string path(const std::string& name) { return folder_ + "/" + name; }

  int replay(std::vector<std::string> words) {
    words.insert(words.begin(), {"log", "replay"});
    Process p("mimesis", words);
    const int code = p.wait(60s).value_or(-1);
    output_ = p.output();
    errors_ = p.errors();
    return code;
  }
  bool says(const std::string& text) const {
    return (output_ + errors_).find(text) != std::string::npos;
  }

  static inline std::string folder_, file_, log_;
  std::string output_, errors_;
};

TEST_F(ReplayLaunch, TheRunIsTheSameAgainAndAgain) {
  const auto size = fs::file_size(log_);
  const auto written = fs::last_write_time(log_);
  EXPECT_EQ(replay({file_, log_, "--repeat", "3", "--json"}), 0) << output_ << errors_;
  const json result = json::parse(output_);
  EXPECT_EQ(result["result"], "equal");
  EXPECT_EQ(result["runs"], 3);
  EXPECT_EQ(result["equal"], 3);
  EXPECT_GE(result["messages"], 80);
  ASSERT_EQ(result["notes"].size(), 1U);
  EXPECT_NE(result["notes"][0].get<std::string>().find("' stopped"), std::string::npos);
  EXPECT_EQ(fs::file_size(log_), size) << "the run to be compared with was overwritten";
  EXPECT_EQ(fs::last_write_time(log_), written);
}

TEST_F(ReplayLaunch, AnotherArgumentOrParameterIsAnotherRun) {
  EXPECT_EQ(replay({file_, log_, "--arg", "salt=3"}), 1);
  EXPECT_TRUE(says("at 0.000000 s: a/out #1 of node 'a' differs\n")) << output_;
  EXPECT_TRUE(says("  start_id  ")) << output_;
  EXPECT_EQ(replay({file_, log_, "--set", "b.salt=3", "--json"}), 1);
  const json result = json::parse(output_);
  EXPECT_EQ(result["result"], "different");
  EXPECT_EQ(result["differences"][0]["topic"], "b/out");
  EXPECT_EQ(result["differences"][0]["seq"], 1);
  EXPECT_EQ(replay({file_, log_, "--set", "b.slat=3"}), 2);
  EXPECT_TRUE(says("did you mean 'salt'?")) << errors_;
  EXPECT_EQ(replay({file_, log_, "--set", "salt=3"}), 2);
}

TEST_F(ReplayLaunch, AnAlteredOrMissingRecordIsFound) {
  const std::string altered = path("altered.mcap"), lossy = path("lossy.mcap");
  copy_log(log_, altered, [](const auto& channel, std::uint32_t seq, std::string& payload) {
    if (channel.topic == "b/out" && seq == 11) {
      v1::Publication m;
      m.ParseFromString(payload);
      m.set_start_id(1);
      payload = m.SerializeAsString();
    }
    return true;
  });
  EXPECT_EQ(replay({file_, altered}), 1);
  EXPECT_TRUE(says("at 0.200000 s: b/out #11 of node 'b' differs\n")) << output_;
  EXPECT_TRUE(says("  start_id  1 ")) << output_;
  copy_log(log_, lossy, [](const auto& channel, std::uint32_t seq, auto&) {
    return channel.topic != "b/out" || seq != 11;
  });
  EXPECT_EQ(replay({file_, lossy}), 1);
  EXPECT_TRUE(says("b/out #11: the log holds no such message")) << output_;
  copy_log(log_, lossy, [](const auto& channel, auto, auto&) { return channel.topic != "b/out"; });
  EXPECT_EQ(replay({file_, lossy}), 0);
  EXPECT_TRUE(says("b/out of node 'b' is not in the log: ")) << output_;
}

TEST_F(ReplayLaunch, ARunThatEndsBeforeItsLogIsNotComplete) {
  EXPECT_EQ(replay({file_, log_, "--set", "clock.until_s=0.3"}), 1);
  EXPECT_TRUE(says("clock/time #")) << "time that ends earlier says so" << output_;
  const std::string timeless = path("timeless.mcap");
  copy_log(log_, timeless,
           [](const auto& channel, auto, auto&) { return channel.topic != "clock/time"; });
  EXPECT_EQ(replay({file_, timeless, "--set", "clock.until_s=0.3"}), 1);
  EXPECT_TRUE(says("the launch ended with exit code")) << output_;
  EXPECT_TRUE(says(" at 0.300000 s of graph time, before ")) << output_;
  EXPECT_TRUE(says("/out #")) << output_;
  EXPECT_TRUE(says(": incomplete: ")) << output_;
}

TEST_F(ReplayLaunch, OnlyLockStepAndNeverOverTheLog) {
  EXPECT_EQ(replay({file_, log_, "--arg", "clock=wall"}), 2);
  EXPECT_TRUE(says("its clock is 'wall'")) << errors_;
  const std::string fixed = path("fixed.yaml");
  std::ofstream(fixed) << graph_file(log_);
  EXPECT_EQ(replay({fixed, log_}), 2);
  EXPECT_TRUE(says("the log to be replayed")) << errors_;
  EXPECT_EQ(replay({path("none.yaml"), log_}), 2);
  EXPECT_EQ(replay({file_, path("none.mcap")}), 3);
}

}  // namespace
}  // namespace mimesis::tool
