// A recording in several files.
#include <gtest/gtest.h>

#include <map>
#include <string>
#include <vector>

#include "common/log/indexed_reader.h"
#include "tools/mimesis/log/record_file.h"

namespace mimesis::tool {
namespace {

/// A recording whose files are strings.
struct MemoryFiles {
  std::map<std::string, std::string> files;  ///< by path

  OpenRecordFile open() {
    return [this](const std::string& path) {
      if (path == refused) throw WriteFailure("no room for " + path);
      files[path].clear();
      return std::make_unique<RecordFile>(
          std::make_unique<log::MemorySink>(files[path]),
          RecordFile::Options{
              .writer = {.compression = log::Compression::none, .background = false},
              .descriptors = [](std::uint64_t hash) { return "set of " + std::to_string(hash); }});
    };
  }
  std::string refused;  ///< this one cannot be opened
};

/// Contents of a file.
struct Contents {
  explicit Contents(const std::string& bytes) {
    const log::MemorySource source(bytes);
    const auto summary = log::summarize(source);
    if (!summary) return;
    closed = summary->from_file;
    for (const auto& index : summary->metadata) {
      if (auto m = log::read_metadata(source, index)) metadata[m->name] = m->metadata;  // the last
    }
    schemas = summary->schemas.size();
    log::IndexedReader reader(source, *summary);
    while (const log::Message* m = reader.next()) {
      messages.push_back(summary->channels.at(m->channel_id).topic + " " +
                         std::to_string(m->sequence));
      times.push_back(m->log_time);
    }
  }
  bool closed = false;
  std::size_t schemas = 0;
  std::map<std::string, std::map<std::string, std::string>> metadata;
  std::vector<std::string> messages;  ///< "TOPIC SEQ"
  std::vector<std::uint64_t> times;   ///< their log times
};

using namespace std::chrono_literals;
using Strings = std::vector<std::string>;
constexpr WallTime kNow{1h};

Recorded split_message(const std::string& topic, std::uint64_t seq, std::uint64_t time_ns,
                       bool latched = false, std::size_t size = 100) {
  Recorded m;
  m.topic = topic;
  m.node = "node";
  m.type = "test.Type";
  m.clock = "lockstep";
  m.seq = seq;
  m.log_time_ns = m.publish_time_ns = time_ns;
  m.ordered = true;
  m.latched = latched;
  m.payload.assign(size, 'x');
  return m;
}

TEST(Split, OneFileIfThereIsNoReasonToSplit) {
  MemoryFiles disk;
  SplitLog split("run.mcap", {}, disk.open());
  for (std::uint64_t i = 1; i <= 100; ++i) split.write(split_message("a", i, i), kNow);
  split.finish(kNow);
  ASSERT_EQ(disk.files.size(), 1u);
  const Contents file(disk.files.at("run.mcap"));
  EXPECT_EQ(file.messages.size(), 100u);
  EXPECT_FALSE(file.metadata.contains("mimesis.split"));
  EXPECT_EQ(file.metadata.at("mimesis.counts").at("total"), "received=100 lost=0");
  EXPECT_EQ(file.metadata.at("mimesis.nodes").at("node"), "lockstep");
}

TEST(Split, ByDurationOfLogTimeWithLatchedValuesAtEveryHead) {
  MemoryFiles disk;
  SplitLog split("log/run.mcap", {.size = 0, .duration = 100ns}, disk.open());
  split.write(split_message("state", 1, 1000, true), kNow);
  split.write(split_message("state", 2, 1010, true), kNow);
  Recorded late = split_message("a", 4, 1099);
  late.lost_before = 3;
  split.write(late, kNow);
  split.write(split_message("a", 5, 1100), kNow);  // the next file begins with this one
  split.write(split_message("a", 6, 1150), kNow);
  split.write(split_message("state", 3, 1300, true), kNow);  // the third
  split.finish(kNow);
  EXPECT_EQ(split.messages(), 6u);
  EXPECT_EQ(split.files().paths(),
            (Strings{"log/run_000.mcap", "log/run_001.mcap", "log/run_002.mcap"}));

  const Contents first(disk.files.at("log/run_000.mcap"));
  const Contents second(disk.files.at("log/run_001.mcap"));
  const Contents third(disk.files.at("log/run_002.mcap"));
  EXPECT_EQ(first.messages, (Strings{"state 1", "state 2", "a 4"}));
  EXPECT_EQ(second.messages, (Strings{"state 2", "a 5", "a 6"}));
  EXPECT_EQ(second.times, (std::vector<std::uint64_t>{1100, 1100, 1150}));
  EXPECT_EQ(third.messages, (Strings{"state 3"}));  // no value of the past beside the new one

  using Map = std::map<std::string, std::string>;
  EXPECT_EQ(first.metadata.at("mimesis.split"),
            (Map{{"index", "0"}, {"previous", ""}, {"next", "run_001.mcap"}}));
  EXPECT_EQ(second.metadata.at("mimesis.split"),
            (Map{{"index", "1"}, {"previous", "run_000.mcap"}, {"next", "run_002.mcap"}}));
  EXPECT_EQ(third.metadata.at("mimesis.split"),
            (Map{{"index", "2"}, {"previous", "run_001.mcap"}, {"next", ""}}));
  EXPECT_EQ(second.metadata.at("mimesis.counts").at("total"), "received=2 lost=0");
  EXPECT_EQ(second.metadata.at("mimesis.counts.whole").at("total"), "received=5 lost=3");
  EXPECT_EQ(third.metadata.at("mimesis.counts.whole").at("a (node)"), "received=3 lost=3");
  for (const Contents* file : {&first, &second, &third}) {
    EXPECT_TRUE(file->closed);
    EXPECT_EQ(file->schemas, 1u);
  }
}

TEST(Split, NoFileIsLargerThanAskedForAndNothingIsLostOrRepeated) {
  constexpr std::uint64_t kSize = 200'000;
  for (const std::size_t payload : {10u, 1000u, 30'000u}) {
    MemoryFiles disk;
    SplitLog split("run.mcap", {.size = kSize}, disk.open());
    const std::uint64_t n = 2'000'000 / (payload + 100);
    for (std::uint64_t i = 1; i <= n; ++i) {
      split.write(split_message("topic" + std::to_string(i % 7), i, i, false, payload), kNow);
      split.advance(kNow + i * 1ms);
    }
    split.finish(kNow);
    Strings all;
    for (const auto& [path, bytes] : disk.files) {
      EXPECT_LE(bytes.size(), kSize) << path;
      const Contents file(bytes);
      all.insert(all.end(), file.messages.begin(), file.messages.end());
    }
    EXPECT_GE(disk.files.size(), n * payload / kSize);
    ASSERT_EQ(all.size(), n);
    for (std::uint64_t i = 1; i <= n; ++i) {
      ASSERT_EQ(all[i - 1], "topic" + std::to_string(i % 7) + " " + std::to_string(i));
    }
    std::uint64_t bytes = 0;
    for (const auto& [path, content] : disk.files) bytes += content.size();
    EXPECT_EQ(split.files().total(), bytes);
  }
}

TEST(Split, TheNextFileIsOpenBeforeThePreviousIsClosed) {
  MemoryFiles disk;
  disk.refused = "run_001.mcap";
  SplitLog split("run.mcap", {.size = 0, .duration = 10ns}, disk.open());
  split.write(split_message("a", 1, 100), kNow);
  try {
    split.write(split_message("a", 2, 110), kNow);
    FAIL() << "it was written nowhere";
  } catch (const WriteFailure& e) {
    EXPECT_STREQ(e.what(), "no room for run_001.mcap");
  }
  split.finish(kNow);  // the one that is open closes well
  const Contents file(disk.files.at("run_000.mcap"));
  EXPECT_TRUE(file.closed);
  EXPECT_EQ(file.messages, (Strings{"a 1"}));
  EXPECT_EQ(file.metadata.at("mimesis.split").at("index"), "0");
}

TEST(Split, TimesOfTheWallClockDoNotSplitARecordingOfGraphTime) {
  MemoryFiles disk;
  SplitLog split("run.mcap", {.size = 0, .duration = 1s}, disk.open());
  Recorded wall = split_message("clock/health", 1, 1'800'000'000'000'000'000);
  wall.ordered = false;
  split.write(wall, kNow);  // before anything else: the clock node starts first
  for (std::uint64_t i = 0; i < 30; ++i) {
    split.write(split_message("a", i + 1, i * 100'000'000), kNow);
    wall.seq += 1;
    wall.log_time_ns += 5'000'000'000;
    split.write(wall, kNow);
  }
  split.finish(kNow);
  EXPECT_EQ(disk.files.size(), 3u);
}

}  // namespace
}  // namespace mimesis::tool
