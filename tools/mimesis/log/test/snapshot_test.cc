// Snapshots of the last messages.
#include <gtest/gtest.h>

#include "tools/mimesis/log/record_file.h"
#include "tools/mimesis/log/test/recorded_messages.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using Strings = std::vector<std::string>;
constexpr WallTime kSnapshotStart{1h};

Recorded snapshot_message(const std::string& topic, std::uint64_t seq, bool latched = false,
                          std::size_t size = 10) {
  Recorded m;
  m.topic = topic;
  m.node = "node";
  m.type = "test.Type";
  m.seq = seq;
  m.log_time_ns = 1000 + seq;
  m.latched = latched;
  m.payload.assign(size, 'x');
  return m;
}

struct Bench {
  explicit Bench(SnapshotOptions options)
      : snapshots(
            std::move(options), "dir/fault.mcap", disk.open(), [] { return "now"; },
            [this](const std::string& line) { lines.push_back(line); }) {}
  void write(Recorded m, WallTime now) {
    m.log_time_ns = static_cast<std::uint64_t>(now.time_since_epoch().count());
    snapshots.write(std::move(m), now);
    snapshots.advance(now);
  }
  Contents file(const std::string& name) const { return Contents(disk.files.at("dir/" + name)); }
  MemoryFiles disk;
  Strings lines;
  Snapshots snapshots;
};

TEST(Snapshot, TheLastSecondsAndTheLatchedValuesBeforeThem) {
  Bench b({.duration = 10s});
  b.write(snapshot_message("state", 1, true), kSnapshotStart);
  b.write(snapshot_message("state", 2, true), kSnapshotStart + 1s);
  for (std::uint64_t i = 1; i <= 60; ++i)
    b.write(snapshot_message("a", i), kSnapshotStart + i * 1s);
  EXPECT_TRUE(b.disk.files.empty());
  b.snapshots.trigger("SIGUSR1", kSnapshotStart + 60s);
  b.write(snapshot_message("a", 61), kSnapshotStart + 60s + 50ms);  // was under way
  b.write(snapshot_message("a", 62), kSnapshotStart + 61s);
  const Contents file = b.file("fault_now.mcap");
  ASSERT_TRUE(file.closed);
  ASSERT_EQ(file.messages.size(), 13u);
  EXPECT_EQ(file.messages[0], "state 2");
  EXPECT_EQ(file.messages[1], "a 50");
  EXPECT_EQ(file.times[0], file.times[1]);
  EXPECT_EQ(file.messages[12], "a 61");
  EXPECT_EQ(file.metadata.at("mimesis.snapshot").at("trigger"), "SIGUSR1");
  EXPECT_EQ(file.metadata.at("mimesis.counts").at("total"), "received=12 lost=0");
  ASSERT_EQ(b.lines.size(), 1u);
  EXPECT_TRUE(b.lines[0].starts_with("dir/fault_now.mcap: 13 messages, ")) << b.lines[0];
  EXPECT_TRUE(b.lines[0].ends_with("(SIGUSR1)")) << b.lines[0];
}

TEST(Snapshot, MemoryIsBoundedInBytes) {
  Bench b({.duration = 1h, .size = 1'000'000});
  for (std::uint64_t i = 1; i <= 1000; ++i) {
    b.write(snapshot_message("a", i, false, 10'000), kSnapshotStart);
    ASSERT_LE(b.snapshots.bytes_in_memory(), 1'000'000u);
  }
  b.snapshots.trigger("SIGUSR1", kSnapshotStart);
  ASSERT_LE(b.snapshots.bytes_in_memory(), 2'000'000u);
  b.snapshots.finish(kSnapshotStart);
  const Contents file = b.file("fault_now.mcap");
  EXPECT_GT(file.messages.size(), 90u);
  EXPECT_EQ(file.messages.back(), "a 1000");
}

TEST(Snapshot, AMessageTriggersOneWithWhatFollows) {
  Bench b({.duration = 10s, .size = 1'000'000, .after = 5s, .topics = {"fault"}});
  for (std::uint64_t i = 1; i <= 20; ++i)
    b.write(snapshot_message("a", i), kSnapshotStart + i * 1s);
  for (std::uint64_t i = 1; i <= 3; ++i) {
    b.write(snapshot_message("fault", i),
            kSnapshotStart + 20s + i * 100ms);  // one fault, told three times
  }
  for (std::uint64_t i = 21; i <= 30; ++i)
    b.write(snapshot_message("a", i), kSnapshotStart + i * 1s);
  ASSERT_EQ(b.lines.size(), 1u);
  const Contents file = b.file("fault_now.mcap");
  EXPECT_EQ(file.messages.front(), "a 11");
  EXPECT_EQ(file.messages.back(), "a 25");
  EXPECT_EQ(file.messages.size(), 18u);
  b.write(snapshot_message("fault", 4), kSnapshotStart + 31s);  // the next one is news
  b.snapshots.finish(kSnapshotStart + 31s);
  EXPECT_EQ(b.lines.size(), 2u);
  EXPECT_EQ(b.file("fault_now-2.mcap").messages.back(), "fault 4");
  EXPECT_EQ(b.snapshots.files().total(), b.disk.files.at("dir/fault_now.mcap").size() +
                                             b.disk.files.at("dir/fault_now-2.mcap").size());
}

TEST(Snapshot, ALargeOneIsWrittenInSlicesAndATriggerMeanwhileGivesTheNext) {
  Bench b({.duration = 1h, .size = 100'000'000});
  for (std::uint64_t i = 1; i <= 100; ++i) {
    b.snapshots.write(snapshot_message("a", i, false, 500'000), kSnapshotStart);
  }
  b.snapshots.trigger("first", kSnapshotStart);
  b.snapshots.advance(kSnapshotStart + 1s);
  EXPECT_TRUE(b.lines.empty());  // 4 of 50 MB
  b.snapshots.write(snapshot_message("a", 101), kSnapshotStart + 1s);
  b.snapshots.trigger("second", kSnapshotStart + 1s);
  b.snapshots.finish(kSnapshotStart + 2s);
  ASSERT_EQ(b.lines.size(), 2u);
  EXPECT_EQ(b.file("fault_now.mcap").messages.size(), 100u);
  EXPECT_EQ(b.file("fault_now-2.mcap").messages.size(), 101u);
}

}  // namespace
}  // namespace mimesis::tool
