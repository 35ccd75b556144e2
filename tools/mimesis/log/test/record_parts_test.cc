// Small parts of the recorder: sizes, limits, end, silence, provenance.
#include <gtest/gtest.h>

#include "proto/foxglove/image.pb.h"
#include "tools/mimesis/log/elided_payload.h"
#include "tools/mimesis/log/provenance.h"
#include "tools/mimesis/log/record_file.h"
#include "tools/mimesis/table.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
constexpr WallTime kStart{1h};

TEST(ByteSize, IsReadStrictly) {
  EXPECT_EQ(to_bytes("4096"), 4096u);
  EXPECT_EQ(to_bytes("1GB"), 1'000'000'000u);
  EXPECT_EQ(to_bytes("1.5 MB"), 1'500'000u);
  EXPECT_EQ(to_bytes("2GiB"), 2'147'483'648u);
  EXPECT_EQ(to_bytes("64kB"), 64'000u);
  for (const char* text : {"", "GB", "1gb", "1 GBx", "-1MB", "1e30", "nan", "1,5MB", "0x10"}) {
    EXPECT_FALSE(to_bytes(text)) << text;
  }
  EXPECT_EQ(bytes_text(999), "999 B");
  EXPECT_EQ(bytes_text(45'234'000), "45.2 MB");
  EXPECT_EQ(bytes_text(999'999'999), "1.0 GB");
}

TEST(DiskLimits, SayWhichIsReached) {
  const std::filesystem::space_info disk{.capacity = 1000, .free = 99, .available = 30};
  EXPECT_EQ(reached_limit({}, 1'000'000, disk), "");
  EXPECT_EQ(reached_limit({.max_size = 2000}, 1999, disk), "");
  EXPECT_EQ(reached_limit({.max_size = 2000}, 2000, disk),
            "the recording has reached --max-size 2.0 kB");
  EXPECT_EQ(reached_limit({.min_free = 30}, 0, disk), "");
  EXPECT_EQ(reached_limit({.min_free = 31}, 0, disk),
            "30 B are free on the disk, less than --min-free 31 B");
  EXPECT_EQ(reached_limit({.min_free_percent = 2.9}, 0, disk), "");
  EXPECT_EQ(reached_limit({.min_free_percent = 3.5}, 0, disk),
            "3.0 % of the disk are free, less than --min-free 3.5%");
  EXPECT_EQ(disk_space("/no/such/file").capacity, 0u);
  EXPECT_GT(disk_space("/tmp/not-yet-there").capacity, 0u);
  EXPECT_GT(disk_space("in-this-folder").capacity, 0u);
}

TEST(DiskLimits, OnlyClosedFilesAreGivenAway) {
  OwnFiles files;
  for (const char* name : {"a", "b", "c"}) {
    files.add(name);
    files.set_size(10);
  }
  files.set_size(5);
  EXPECT_EQ(files.total(), 25u);
  EXPECT_EQ(files.take_oldest(), "a");
  EXPECT_EQ(files.take_oldest(), "b");
  EXPECT_EQ(files.take_oldest(), "");
  EXPECT_EQ(files.last(), "c");
  EXPECT_EQ(files.total(), 5u);
}

TEST(Drain, LeavesABusyGraphOnceEverythingFromBeforeIsIn) {
  Drain drain(kStart, 1000);
  auto now = kStart;
  for (int i = 0; i < 9; ++i) {  // a backlog, then only news, without a pause
    drain.received(now += 20ms, false, 900);
    ASSERT_FALSE(drain.over(now));
  }
  for (int i = 0; i < 4; ++i) {
    drain.received(now += 20ms, false, 2000);
    ASSERT_FALSE(drain.over(now));
  }
  drain.received(now += 20ms, false, 2000);
  EXPECT_TRUE(drain.over(now));
  EXPECT_FALSE(drain.gave_up(now));
}

TEST(Drain, QuietOrTooLong) {
  Drain quiet(kStart, 1000);
  EXPECT_FALSE(quiet.over(kStart + 99ms));
  EXPECT_TRUE(quiet.over(kStart + 100ms));
  EXPECT_FALSE(quiet.gave_up(kStart + 100ms));
  Drain endless(kStart, 1000);
  auto now = kStart;
  for (; !endless.over(now); now += 10ms) endless.received(now, false, 1);
  EXPECT_EQ(now, kStart + 2s);
  EXPECT_TRUE(endless.gave_up(now));
  Drain unknown(kStart, 1000);  // no publish time
  unknown.received(kStart + 90ms, false, 0);
  EXPECT_TRUE(unknown.over(kStart + 100ms));
}

TEST(Drain, SimulatedTimeOfTheSignalIsTheLatestSeenRightBehindIt) {
  Drain drain(kStart, 1'800'000'000'000'000'000);
  drain.received(kStart + 10ms, true, 5000);
  drain.received(kStart + 80ms, true, 6000);
  drain.received(kStart + 120ms, true, 6000);  // within the same step
  drain.received(kStart + 160ms, true, 7000);
  EXPECT_FALSE(drain.over(kStart + 219ms));
  EXPECT_TRUE(drain.over(kStart + 220ms));
}

Counts counts(std::uint64_t n) {
  Counts c;
  for (std::uint64_t i = 0; i < n; ++i) {
    Recorded m;
    m.topic = "a/out";
    m.node = "a";
    c.add(m);
    m.topic = "b/out";
    m.node = "b";
    m.lost_before = i == 0 ? 3 : 0;
    c.add(m);
  }
  return c;
}

TEST(SilenceWatch, TellsOnceAfterTwoSecondsOfThePublishersTime) {
  SilenceWatch watch;
  watch.met("a/out", "a", false, {100s, 0s});
  watch.met("c/out", "c", false, {100s, 0s});
  watch.met("d/out", "d", true, {100s, 0s});  // waits for other nodes
  watch.met("d/out", "d", true, {101s, 50s});
  EXPECT_TRUE(watch.silent(counts(1), {101s, 0s}).empty());
  watch.met("c/out", "c", false, {101s, 0s});
  using Topics = std::vector<std::string>;
  EXPECT_EQ(watch.silent(counts(1), {102s, 0s}), Topics{"c/out (c)"});
  EXPECT_TRUE(watch.silent(counts(1), {1000s, 51s}).empty());
  EXPECT_EQ(watch.silent(counts(1), {1000s, 52s}), Topics{"d/out (d)"});
  EXPECT_TRUE(watch.silent(counts(1), {2000s, 55s}).empty());
}

TEST(Provenance, HoldsTheCommandAndTheLaunch) {
  const Provenance from = provenance(
      "lab", {"mimesis", "log", "record", "it's"}, 1'800'000'000'000'000'000,
      R"({"file":"a/b.yaml","args":["x=1","y=a b"],"sets":["n.k=2"],"clock":"sim","graph":"lab"})");
  EXPECT_EQ(from.run.name, "mimesis.run");
  EXPECT_EQ(from.run.metadata.at("command"), "mimesis log record 'it'\\''s'");
  EXPECT_EQ(from.run.metadata.at("started"), "2027-01-15T08:00:00Z");
  EXPECT_EQ(from.run.metadata.at("graph"), "lab");
  ASSERT_TRUE(from.launch);
  EXPECT_EQ(from.launch->metadata, (std::map<std::string, std::string>{{"file", "a/b.yaml"},
                                                                       {"args", "x=1\ny=a b\n"},
                                                                       {"sets", "n.k=2\n"},
                                                                       {"clock", "sim"},
                                                                       {"graph", "lab"}}));
  EXPECT_EQ(from.launch_files, std::vector<std::string>{"a/b.yaml"});
  for (const char* text : {"", "{", "{\"file\":1}", "[]"}) {
    EXPECT_FALSE(provenance("lab", {}, 0, text).launch) << text;
  }
}

TEST(ElidedPayload, KeepsSmallFieldsAndASumOfAll) {
  foxglove::RawImage image;
  image.set_width(640);
  image.set_encoding("bgr8");
  image.set_data(std::string(100'000, 'x'));
  const std::string elided = elide(image.SerializeAsString());
  EXPECT_LT(elided.size(), 100U);
  foxglove::RawImage read;
  ASSERT_TRUE(read.ParseFromString(elided));  // for every reader a message of its type
  EXPECT_EQ(read.width(), 640U);
  EXPECT_EQ(read.encoding(), "bgr8");
  EXPECT_TRUE(read.data().empty());

  // each bit of a word counts, wherever the word ends
  for (const std::size_t from : {std::size_t{0}, std::size_t{50'001}, std::size_t{99'984}}) {
    for (std::size_t at = from; at < from + 16; ++at) {
      for (int bit = 0; bit < 8; ++bit) {
        foxglove::RawImage other = image;
        (*other.mutable_data())[at] = static_cast<char>('x' ^ (1 << bit));
        EXPECT_NE(elide(other.SerializeAsString()), elided) << at << ", " << bit;
      }
    }
  }
  EXPECT_EQ(elide(image.SerializeAsString()), elided);
}

TEST(ElidedPayload, LeavesWhatIsNoMessageWhole) {
  const std::string cut = std::string("\x0a\xff\xff\x03", 4) + "short";  // says 65535 bytes follow
  EXPECT_EQ(elide(cut), cut);
}
}  // namespace
}  // namespace mimesis::tool
