// The recorder as a process: ends, splits, limits, full disks.
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numeric>

#include "tools/mimesis/log/test/record_fixture.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using testing::Process;
using Seqs = std::vector<std::uint32_t>;
namespace fs = std::filesystem;

constexpr auto kPatience = 60s;  // with much to write on a loaded machine

Seqs from_to(std::uint32_t first, std::uint64_t last) {
  Seqs seqs(last - first + 1);
  std::iota(seqs.begin(), seqs.end(), first);
  return seqs;
}

bool says(const Process& process, const std::string& text) {
  return process.errors().find(text) != std::string::npos;
}

/// Publishes to a recorder until it ends; its exit code, or none if it does not end.
std::optional<int> send_until_ended(const testing::TestGraph& graph, Process& recorder) {
  Sender sender(graph);
  std::optional<int> code;
  sender.node.until(
      [&] {
        if (sender.count.subscribers() > 0) sender.send(30, 1000);
        return (code = recorder.wait(0ms)).has_value();
      },
      kPatience);
  return code;
}

/// Names of the logs in a folder, sorted.
std::vector<std::string> logs_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == ".mcap") names.push_back(entry.path().filename());
  }
  std::sort(names.begin(), names.end());
  return names;
}

TEST_F(RecordProcess, WaitsOnlySoLongForTheFirstMessage) {
  const auto recorder = record({"--all", "--timeout", "0.3"});
  EXPECT_EQ(recorder->wait(kPatience), 3);
  EXPECT_TRUE(says(*recorder, "nothing was recorded: no message came")) << recorder->errors();
}

TEST_F(RecordProcess, EverySignalLeavesABusyGraphWithAllThatWasPublishedBefore) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    const auto recorder = record({"--all"});
    Sender sender(graph_);
    ASSERT_TRUE(sender.node.wait_subscriber(sender.count));
    sender.send(2000);  // most of it is still on its way
    recorder->signal(signal);
    const std::uint64_t before = sender.sent;
    std::optional<int> code;
    ASSERT_TRUE(sender.node.until([&] {
      sender.send(1);  // the graph continues
      return (code = recorder->wait(0ms)).has_value();
    }));
    EXPECT_EQ(code, 0) << recorder->errors();
    const LogContents log(path("run.mcap"));
    EXPECT_TRUE(log.closed);
    const Seqs& seqs = log.seqs.at("sender/count");
    EXPECT_GE(seqs.size(), before);
    EXPECT_EQ(seqs, from_to(1, seqs.size()));
  }
}

TEST_F(RecordProcess, SplitsWithoutLossAndEachPartIsWholeInItself) {
  const auto recorder = record({"--all", "--split-size", "150kB", "--compression", "lz4"});
  Sender sender(graph_);
  sender.send(20'000, 40);
  const auto recorded = [&] {
    std::size_t messages = 0;
    for (const std::string& name : logs_in(folder_)) {
      messages += LogContents(path(name)).seqs["sender/count"].size();
    }
    return messages;
  };
  EXPECT_TRUE(sender.node.until([&] { return recorded() == 20'000; }, kPatience));
  recorder->signal(SIGINT);
  std::optional<int> code;
  ASSERT_TRUE(sender.node.until([&] { return (code = recorder->wait(0ms)).has_value(); }));
  EXPECT_EQ(code, 0) << recorder->errors();

  const auto report = nlohmann::json::parse(recorder->output());
  const auto names = logs_in(folder_);
  ASSERT_EQ(report["files"].size(), names.size());
  Seqs all;
  std::uint64_t counted = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    EXPECT_EQ(report["files"][i], path(names[i]));
    EXPECT_LE(fs::file_size(path(names[i])), 150'000u);
    LogContents log(path(names[i]));
    EXPECT_TRUE(log.closed);
    EXPECT_EQ(log.seqs["sender/state"], Seqs{1}) << names[i];
    const Seqs& part = log.seqs["sender/count"];
    all.insert(all.end(), part.begin(), part.end());
    const std::string own = log.metadata["mimesis.counts"]["sender/count (sender)"];
    EXPECT_EQ(own, "received=" + std::to_string(part.size()) + " lost=0");
    counted += part.size();
    EXPECT_EQ(log.metadata["mimesis.counts.whole"]["sender/count (sender)"],
              "received=" + std::to_string(counted) + " lost=0");
    EXPECT_EQ(log.metadata["mimesis.split"]["next"], i + 1 < names.size() ? names[i + 1] : "");
  }
  EXPECT_EQ(all, from_to(1, 20'000));
  EXPECT_GE(names.size(), 5u);

  Process again("mimesis",
                {"log", "record", "--all", "-o", path("run.mcap"), "--split-size", "1MB"});
  EXPECT_EQ(again.wait(), 2);
  EXPECT_TRUE(says(again, "from an earlier recording")) << again.errors();
}

TEST_F(RecordProcess, ALimitClosesTheLogWell) {
  const auto recorder = record({"--all", "--max-size", "300kB", "--compression", "none"});
  Sender sender(graph_);
  std::optional<int> code;
  const auto ended = [&] {
    sender.send(10, 1000);
    return (code = recorder->wait(0ms)).has_value();
  };
  ASSERT_TRUE(sender.node.until(ended, kPatience));
  EXPECT_EQ(code, 1);
  EXPECT_TRUE(says(*recorder, "recording stopped: the recording has reached --max-size 300.0 kB"))
      << recorder->errors();
  const LogContents log(path("run.mcap"));
  EXPECT_TRUE(log.closed);
  EXPECT_EQ(log.seqs.at("sender/count"), from_to(1, log.seqs.at("sender/count").size()));

  Process full("mimesis", {"log", "record", "--all", "-o", path("b.mcap"), "--min-free", "99.9%"});
  EXPECT_EQ(full.wait(), 1);
  EXPECT_TRUE(says(full, "less than --min-free 99.9%")) << full.errors();
}

TEST_F(RecordProcess, TheOldestOwnFilesMakeRoom) {
  std::ofstream(path("run_other.mcap")) << "not ours";
  const auto recorder = record({"--all", "--split-size", "300kB", "--max-size", "2MB",
                                "--when-full", "delete-oldest", "--compression", "none"});
  Sender sender(graph_);
  const auto deleted = [&] {
    sender.send(10, 1000);
    return says(*recorder, "deleted '" + path("run_003.mcap"));
  };
  ASSERT_TRUE(sender.node.until(deleted, kPatience));
  recorder->signal(SIGINT);
  std::optional<int> code;
  ASSERT_TRUE(sender.node.until([&] { return (code = recorder->wait(0ms)).has_value(); }));
  EXPECT_EQ(code, 0) << recorder->errors();
  const auto report = nlohmann::json::parse(recorder->output());
  EXPECT_TRUE(fs::exists(path("run_other.mcap")));
  EXPECT_FALSE(fs::exists(path("run_000.mcap")));
  Seqs all;
  for (const auto& file : report["files"]) {
    LogContents log(file.get<std::string>());
    EXPECT_EQ(log.seqs["sender/state"], Seqs{1});
    const Seqs& part = log.seqs["sender/count"];
    all.insert(all.end(), part.begin(), part.end());
  }
  EXPECT_EQ(all, from_to(all.front(), sender.sent));
  EXPECT_GT(all.front(), 1u);
}

TEST_F(RecordProcess, AFullDiskLeavesAFileThatOpensUpToTheFailure) {
  // A disk of 8 MB that only this process sees; its files are copied out afterwards.
  const std::string script =
      "mount -t tmpfs -o size=8m none \"$1\" || exit 77\n"
      "shift\n\"$0\" log record --all -o disk/run.mcap \"$@\"\ncode=$?\n"
      "cp disk/run*.mcap . && exit $code";
  fs::create_directory(folder_ / "disk");
  const std::string program = fs::path(MIMESIS_BIN_DIR) / "mimesis";
  for (const std::vector<std::string>& options :
       {std::vector<std::string>{}, {"--split-size", "3MB"}}) {
    std::vector<std::string> arguments{"-m", "sh", "-c", script, program, "disk"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const fs::path here = fs::current_path();
    fs::current_path(folder_);
    Process recorder("/usr/bin/unshare", arguments);
    fs::current_path(here);
    const std::optional<int> code = send_until_ended(graph_, recorder);
    if (code == 77 || says(recorder, "unshare failed"))
      GTEST_SKIP() << "not here: no mount namespaces";
    EXPECT_EQ(code, 1) << recorder.errors();
    EXPECT_TRUE(says(recorder, "recording stopped: cannot write")) << recorder.errors();
    EXPECT_TRUE(says(recorder, "No space left on device")) << recorder.errors();
    Seqs all;
    for (const std::string& name : logs_in(folder_)) {
      LogContents log(path(name));
      EXPECT_TRUE(log.opens);
      const Seqs& part = log.seqs["sender/count"];
      all.insert(all.end(), part.begin(), part.end());
    }
    ASSERT_FALSE(all.empty());
    EXPECT_EQ(all, from_to(all.front(), all.back()));
    EXPECT_GT(all.size() * 1000, 6'000'000u);  // at most the last chunk of 1 MiB is lost
    for (const std::string& name : logs_in(folder_)) fs::remove(path(name));
  }
}

TEST_F(RecordProcess, ALimitOfFileSizesIsAFullDiskAndTheCountIsThatOfTheFile) {
  const std::string script = "ulimit -f 4000; exec \"$0\" log record --all --json -o \"$1\"";
  Process recorder("/bin/sh",
                   {"-c", script, fs::path(MIMESIS_BIN_DIR) / "mimesis", path("run.mcap")});
  const std::optional<int> code = send_until_ended(graph_, recorder);
  EXPECT_EQ(code, 1) << recorder.errors();
  EXPECT_TRUE(says(recorder, "File too large")) << recorder.errors();
  std::uint64_t standing = 0;
  for (const auto& [topic, seqs] : LogContents(path("run.mcap")).seqs) standing += seqs.size();
  EXPECT_GT(standing, 100u);
  EXPECT_EQ(nlohmann::json::parse(recorder.output())["messages"], standing);
}

TEST_F(RecordProcess, ASecondRecorderOfAFileIsRefused) {
  const auto recorder = record({"--all"});
  Process second("mimesis", {"log", "record", "--all", "-o", path("run.mcap")});
  EXPECT_EQ(second.wait(), 2);
  EXPECT_TRUE(says(second, "'" + path("run.mcap") + "': another process is writing it"))
      << second.errors();
  Sender sender(graph_);
  sender.send(10);
  EXPECT_EQ(recorder->terminate(), 0) << recorder->errors();
  EXPECT_EQ(LogContents(path("run.mcap")).seqs.at("sender/count"), from_to(1, 10));
}

TEST_F(RecordProcess, NothingRecordedIsAFailureAndASilentPublisherIsTold) {
  const auto recorder = record({"--all"});
  testing::TestNode silent(graph_, {}, {}, "silent");
  runtime::Out<v1::Publication> out(silent.bus(), "out");
  silent.open();
  EXPECT_TRUE(silent.until([&] {
    return says(*recorder, "no message for 2 s although there is a publisher: silent/out (silent)");
  })) << recorder->errors();
  EXPECT_EQ(recorder->terminate(), 1);
  EXPECT_TRUE(says(*recorder, "nothing was recorded: no message came")) << recorder->errors();
  EXPECT_TRUE(LogContents(path("run.mcap")).closed);
}

TEST_F(RecordProcess, TheLogSaysWhereItComesFrom) {
  std::ofstream(path("lab.yaml")) << "nodes: {}\n";
  std::ofstream(path("eyes.yaml")) << "nodes: {}\n";
  setenv("MIMESIS_LAUNCH",
         nlohmann::json{{"file", path("lab.yaml")},
                        {"included", {path("eyes.yaml"), path("gone.yaml")}},
                        {"args", {"speed=2"}},
                        {"sets", {"arm.k=3"}},
                        {"clock", "wall"},
                        {"graph", "lab"}}
             .dump()
             .c_str(),
         1);
  const auto recorder = record({"--all", "--sync", "10ms"});
  unsetenv("MIMESIS_LAUNCH");
  Sender sender(graph_);
  sender.send(1);
  recorder->signal(SIGINT);
  EXPECT_EQ(recorder->wait(), 0) << recorder->errors();
  LogContents log(path("run.mcap"));
  EXPECT_EQ(log.attachments, (std::vector<std::string>{"lab.yaml", "eyes.yaml"}));
  EXPECT_EQ(log.metadata["mimesis.launch"]["args"], "speed=2\n");
  EXPECT_EQ(log.metadata["mimesis.launch"]["sets"], "arm.k=3\n");
  EXPECT_TRUE(log.metadata["mimesis.run"]["command"].ends_with("--all --sync 10ms"));
  EXPECT_FALSE(log.metadata["mimesis.run"]["host"].empty());
  EXPECT_EQ(log.metadata["mimesis.run"]["graph"], graph_.name());
  EXPECT_EQ(log.metadata["mimesis.nodes"]["sender"], "wall");
}

TEST_F(RecordProcess, MistakesAreOneLine) {
  const auto refuses = [&](std::vector<std::string> options, const std::string& why) {
    options.insert(options.begin(), {"log", "record", "--all", "-o", path("x.mcap")});
    Process process("mimesis", options);
    EXPECT_EQ(process.wait(), 2) << process.errors();
    EXPECT_TRUE(says(process, why)) << process.errors();
    EXPECT_FALSE(fs::exists(path("x.mcap")));
  };
  refuses({"--split-size", "1 gigabyte"}, "expected a size such as 500MB");
  refuses({"--split-duration", "10"}, "expected a duration such as 500ms");
  refuses({"--min-free", "120%"}, "expected a size such as 2GB or a percentage such as 5%");
  refuses({"--when-full", "delete-oldest", "--max-size", "1GB"}, "and several files");
  refuses({"--when-full", "delete-oldest", "--max-size", "1GB", "--split-size", "2GB"},
          "--split-size must be less than --max-size");
}

}  // namespace
}  // namespace mimesis::tool
