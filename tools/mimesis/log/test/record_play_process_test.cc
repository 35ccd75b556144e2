// `mimesis log record|play|info` as processes.
#include <gtest/gtest.h>
#include <stdlib.h>

#include <csignal>
#include <nlohmann/json.hpp>

#include "common/log/indexed_reader.h"
#include "common/testing/process.h"
#include "common/testing/temporary_folder.h"
#include "proto/runtime.pb.h"

namespace mimesis::tool {
namespace {

using runtime::Out;
using runtime::Reliable;
using testing::Process;
using testing::TestGraph;
using testing::TestNode;

const std::string kText = MIMESIS_SOURCE_DIR "/LICENSE";  // no log

class LogProcess : public ::testing::Test {
 protected:
  void SetUp() override {
    setenv("MIMESIS_GRAPH", graph_.name().c_str(), 1);
    file_ = (folder_ / "run.mcap").string();
  }

  std::unique_ptr<Process> record(std::vector<std::string> options) {
    std::vector<std::string> arguments{"log", "record", "--json", "--output", file_};
    arguments.insert(arguments.end(), options.begin(), options.end());
    auto process = std::make_unique<Process>("mimesis", arguments);
    const std::string name = "tap-" + std::to_string(process->pid()) + "-1";
    EXPECT_TRUE(process->wait_ready(graph_, name)) << process->errors();
    return process;
  }

  /// Messages in the file now.
  std::uint64_t recorded() const {
    const auto source = log::open_file(file_);
    if (!source) return 0;
    const auto summary = log::summarize(**source);
    return summary ? summary->statistics.message_count : 0;
  }

  TestGraph graph_;
  testing::TemporaryFolder folder_;
  std::string file_;
};

/// Publishes a counter and a latched value.
struct Sender {
  explicit Sender(const TestGraph& graph)
      : node(graph, {}, {}, "sender"),
        count(node.bus(), "count"),
        state(node.bus(), "state", {.latched = true}) {
    node.open();
  }
  void send(std::uint64_t n) {
    v1::Publication m;
    for (std::uint64_t i = 0; i < n; ++i) {
      m.set_seq(++sent);
      m.set_topic(std::string(m.seq() % 100, 'x'));
      count.send(m, TestNode::now());
      if (sent == 1) state.send(m, TestNode::now());
    }
  }
  TestNode node;
  Out<v1::Publication> count, state;
  std::uint64_t sent = 0;
};

TEST_F(LogProcess, RecordsAllWithTypesAndClosesOnEverySignal) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const auto recorder = record({"--all", "--attach", kText});
    Sender sender(graph_);
    sender.send(500);
    ASSERT_TRUE(sender.node.until([&] { return recorded() == 501; }));
    recorder->signal(signal);
    EXPECT_EQ(recorder->wait(), 0) << recorder->errors();
    const auto report = nlohmann::json::parse(recorder->output());
    EXPECT_EQ(report["messages"], 501);
    EXPECT_EQ(report["lost"], 0);

    const auto source = log::open_file(file_);
    ASSERT_TRUE(source);
    const auto summary = log::summarize(**source);
    ASSERT_TRUE(summary);
    EXPECT_TRUE(summary->from_file);
    EXPECT_EQ(summary->attachments.at(0).name, "LICENSE");
    const auto& schema = summary->schemas.at(1);
    EXPECT_EQ(schema.name, "mimesis.v1.Publication");
    runtime::TypePool pool;
    log::IndexedReader reader(**source, *summary);
    std::uint64_t expected = 0;
    while (const log::Message* m = reader.next()) {
      const log::Channel& channel = summary->channels.at(m->channel_id);
      EXPECT_EQ(channel.metadata.at("node"), "sender");
      EXPECT_EQ(channel.metadata.at("latched"), channel.topic == "sender/state" ? "true" : "false");
      EXPECT_GE(m->log_time, m->publish_time);
      if (channel.topic != "sender/count") continue;
      EXPECT_EQ(m->sequence, ++expected);
      const auto message =
          pool.make(schema.name, schema.data);  // by the descriptors in the file alone
      ASSERT_NE(message, nullptr);
      ASSERT_TRUE(message->ParseFromArray(m->data.data(), static_cast<int>(m->data.size())));
      v1::Publication same;
      ASSERT_TRUE(same.ParseFromString(message->SerializeAsString()));
      EXPECT_EQ(same.seq(), expected);
    }
    EXPECT_EQ(expected, 500U);
  }
}

TEST_F(LogProcess, AKilledRecorderLeavesAReadableFile) {
  const auto recorder = record({"--all"});
  Sender sender(graph_);
  sender.send(1000);
  ASSERT_TRUE(
      sender.node.until([&] { return recorded() == 1001; }));  // without being asked to close
  sender.send(1);
  recorder->signal(SIGKILL);
  EXPECT_EQ(recorder->wait(), 128 + SIGKILL);
  EXPECT_GE(recorded(), 1001U);

  Process info("mimesis", {"log", "info", "--json", file_});
  EXPECT_EQ(info.wait(), 0);
  const auto described = nlohmann::json::parse(info.output());
  EXPECT_EQ(described["closed"], false);
  EXPECT_GE(described["messages"], 1001);
  EXPECT_EQ(described["damages"].size(), 1U);
}

TEST_F(LogProcess, FiltersTopics) {
  const auto recorder =
      record({"--regex", "sender/.*", "--exclude", ".*/count", "--compression", "lz4"});
  Sender sender(graph_);
  sender.send(10);
  ASSERT_TRUE(sender.node.until([&] { return recorded() == 1; }));
  EXPECT_EQ(recorder->terminate(), 0);
  const auto report = nlohmann::json::parse(recorder->output());
  ASSERT_EQ(report["topics"].size(), 1U);
  EXPECT_EQ(report["topics"][0]["topic"], "sender/state");
}

TEST_F(LogProcess, PlaysWhatWasRecordedInOrderAndLatched) {
  {
    const auto recorder = record({"--all"});
    Sender sender(graph_);
    sender.send(300);
    ASSERT_TRUE(sender.node.until([&] { return recorded() == 301; }));
    EXPECT_EQ(recorder->terminate(), 0);
  }
  TestNode listener(graph_, {{"count", "sender/count"}, {"state", "sender/state"}}, {});
  Reliable<v1::Publication> count(listener.bus(), "count"), state(listener.bus(), "state");
  listener.open();
  Process player("mimesis", {"log", "play", "--json", "--loop", "2", "--topic", "sender/count",
                             "--topic", "sender/state", file_});
  for (std::uint64_t loop = 0; loop < 2; ++loop) {
    for (std::uint64_t i = 1; i <= 300; ++i) {
      const auto m = listener.receive(count);
      ASSERT_TRUE(m) << player.errors();
      ASSERT_EQ(m->seq(), i);
      ASSERT_EQ(m->topic(), std::string(i % 100, 'x'));
    }
    const auto s = listener.receive(state);
    ASSERT_TRUE(s);
    EXPECT_EQ(s->seq(), 1U);
  }
  EXPECT_EQ(player.wait(), 0) << player.errors();
  EXPECT_EQ(nlohmann::json::parse(player.output())["messages"], 602);
}

TEST_F(LogProcess, MistakesAreOneLineAndAnExitCode) {
  const auto run = [](std::vector<std::string> arguments, int code, const std::string& says) {
    Process process("mimesis", arguments);
    EXPECT_EQ(process.wait(), code) << process.errors();
    EXPECT_NE(process.errors().find(says), std::string::npos) << process.errors();
  };
  run({"log", "record", "-o", file_}, 2, "say what: --all, --topic NAME or --regex RE");
  run({"log", "record", "--all", "-o", "/dev/full"}, 2, "No space left on device");
  run({"log", "record", "--regex", "(", "-o", file_}, 2, "is no regular expression");
  run({"log", "record", "--all", "-o", file_, "--attach", "/no/file"}, 2, "cannot read '/no/file'");
  run({"log", "play", "/no/file.mcap"}, 3, "cannot open '/no/file.mcap'");
  run({"log", "play", kText}, 1, "not an MCAP log");
  run({"log", "play", kText, "--rate", "0"}, 2, "--rate");
  run({"topic", "hz", "a/b", "--timeout", "x"}, 2, "expected a number above 0, found 'x'");
  run({"log", "info", "/no/file.mcap"}, 3, "cannot open '/no/file.mcap'");
  run({"log", "info", kText}, 1, "not an MCAP log");
}

}  // namespace
}  // namespace mimesis::tool
