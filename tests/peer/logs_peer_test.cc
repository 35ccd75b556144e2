// Logs of our recorder and of the verbs that change logs, in the format's reference reader: every
// checksum, equal counts per topic, equal payloads.
#include <fmt/format.h>

#include <csignal>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/testing/process.h"
#include "proto/runtime.pb.h"
#include "tests/peer/foreign.h"

namespace mimesis::peer {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

constexpr int kMessages = 1500;  // before the kill, and again behind it

class LogsPeer : public Foreign {
 protected:
  void SetUp() override {
    Foreign::SetUp();
    setenv("MIMESIS_GRAPH", graph_.name().c_str(), 1);
  }
  std::string path(const std::string& name) const { return (folder_ / (name + ".mcap")).string(); }

  std::unique_ptr<Process> record(const std::string& name, const std::string& codec,
                                  std::vector<std::string> options = {}) {
    std::vector<std::string> arguments{"log", "record",   "--all",   "--compression",
                                       codec, "--output", path(name)};
    arguments.insert(arguments.end(), options.begin(), options.end());
    auto process = std::make_unique<Process>("mimesis", arguments);
    EXPECT_TRUE(process->wait_ready(graph_, "tap-" + std::to_string(process->pid()) + "-1"))
        << process->errors();
    return process;
  }
  /// `mimesis log ...` that succeeds.
  static void log_verb(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "log");
    Process process("mimesis", arguments);
    EXPECT_EQ(process.wait(60s), 0) << process.errors();
  }
  static int recorded(const std::string& file, const std::string& topic) {
    const auto source = log::open_file(file);
    if (!source) return 0;
    log::StreamReader reader(**source);
    return contents_of(reader).counts[topic];
  }
  void record_all_kinds(const std::string& codec);

  TestGraph graph_;
};

/// Three recorders of one sender: one is killed in the middle, one closes, one splits.
void LogsPeer::record_all_kinds(const std::string& codec) {
  const auto closed = record("closed-" + codec, codec);
  const auto killed = record("killed-" + codec, codec);
  const auto split = record("split-" + codec, codec, {"--split-size", "50kB"});
  TestNode node(graph_, {}, {}, "sender");
  runtime::Out<v1::Publication> count(node.bus(), "count");
  runtime::Out<v1::Publication> state(node.bus(), "state", {.latched = true});
  node.open();
  std::uint32_t random = 1;
  v1::Publication message;
  const auto send = [&] {
    for (int i = 0; i < kMessages; ++i) {
      message.clear_topic();
      for (int k = 0; k < 100; ++k) {
        random = random * 1664525u + 1013904223u;
        message.mutable_topic()->push_back(static_cast<char>('!' + (random >> 24) % 90));
      }
      count.send(message, TestNode::now());
      if (i == 0) state.send(message, TestNode::now());
    }
  };
  const auto has = [&](const std::string& name, int messages) {
    return [=, this] { return recorded(path(name + "-" + codec), "sender/count") >= messages; };
  };
  send();
  EXPECT_TRUE(node.until(has("killed", kMessages)));
  send();
  killed->signal(SIGKILL);
  EXPECT_EQ(killed->wait(), 128 + SIGKILL);
  EXPECT_TRUE(node.until(has("closed", 2 * kMessages)));
  for (const auto& recorder : {closed.get(), split.get()}) {
    EXPECT_EQ(recorder->terminate(), 0) << recorder->errors();
  }
}

TEST_F(LogsPeer, TwentyOfTwentyOfOurLogsAreReadAlike) {
  std::vector<fs::path> files;
  for (const std::string codec : {"none", "lz4", "zstd"}) {
    record_all_kinds(codec);
    log_verb({"recover", path("killed-" + codec), "-o", path("recovered-" + codec)});
    log_verb({"filter", path("closed-" + codec), "-o", path("filtered-" + codec), "--topic",
              "sender/count", "--compression", codec});
    for (const char* kind : {"closed-", "killed-", "recovered-", "filtered-"}) {
      files.push_back(path(kind + codec));
    }
    files.push_back(folder_ / ("split-" + codec + "_000.mcap"));
    files.push_back(folder_ / ("split-" + codec + "_001.mcap"));
  }
  std::vector<std::string> merge{"filter", "-o", path("merged")};
  for (int part = 0;; ++part) {
    const fs::path file = folder_ / fmt::format("split-zstd_{:03}.mcap", part);
    if (!fs::exists(file)) break;
    merge.push_back(file.string());
  }
  log_verb(merge);
  files.push_back(path("merged"));
  ASSERT_EQ(files.size(), 19u);

  const nlohmann::json peer = read_with_peer(files);
  ASSERT_EQ(peer.size(), files.size());
  int alike = 0;
  std::map<std::string, int> ours;  // messages on sender/count, by name of the file
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string name = files[i].stem().string();
    const auto source = log::open_file(files[i].string());
    ASSERT_TRUE(source);
    log::StreamReader reader(**source);
    const Contents contents = contents_of(reader);
    const bool killed = name.starts_with("killed");
    ours[name] = contents.counts.contains("sender/count") ? contents.counts.at("sender/count") : 0;
    EXPECT_FALSE(contents.counts.empty()) << name;
    EXPECT_EQ(contents.counts, contents_of(peer[i]).counts) << name;
    EXPECT_EQ(contents.digest, contents_of(peer[i]).digest) << name;
    EXPECT_EQ(peer[i]["done"], !killed) << name;
    EXPECT_EQ(reader.complete(), !killed) << name;
    if (!killed) {
      EXPECT_EQ(peer[i]["indexed"], peer[i]["streamed"]) << name;
      EXPECT_EQ(reader.damage_count(), 0u) << name;
      EXPECT_TRUE(peer[i]["ordered"]) << name;
    }
    alike += contents == contents_of(peer[i]) ? 1 : 0;
  }
  for (const std::string codec : {"none", "lz4", "zstd"}) {
    EXPECT_EQ(ours["closed-" + codec], 2 * kMessages);
    EXPECT_EQ(ours["filtered-" + codec], 2 * kMessages);
    EXPECT_GE(ours["killed-" + codec], kMessages);
    EXPECT_EQ(ours["recovered-" + codec], ours["killed-" + codec]);
  }
  EXPECT_EQ(ours["merged"], 2 * kMessages);
  std::cout << fmt::format("{} of {} logs of ours are read alike\n", alike, files.size());
}

}  // namespace
}  // namespace mimesis::peer
