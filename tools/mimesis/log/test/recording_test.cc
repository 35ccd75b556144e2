// Recording without a graph.
#include <gtest/gtest.h>

#include "common/log/summary.h"
#include "tools/mimesis/log/record_file.h"
#include "tools/mimesis/topic_filter.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
constexpr WallTime kRecordingStart{1h};

Recorded recording_message(const std::string& node, std::uint64_t seq, std::uint64_t time_ns,
                           const std::string& payload = "x") {
  Recorded m;
  m.topic = node + "/out";
  m.type = "test.Type";
  m.node = node;
  m.seq = seq;
  m.log_time_ns = m.publish_time_ns = time_ns;
  m.ordered = true;
  m.payload = payload;
  return m;
}

struct Recorder {
  std::string bytes;
  RecordFile file{std::make_unique<log::MemorySink>(bytes),
                  {.writer = {.background = false}, .descriptors = [](std::uint64_t hash) {
                     return "descriptors of " + std::to_string(hash);
                   }}};
  Recording recording{[this](const Recorded& m, WallTime now) { file.write(m, now); }};

  void advance(WallTime now) {
    recording.advance(now);
    file.advance(now);
  }
  std::string finish() {
    recording.finish(kRecordingStart);
    file.finish();
    return bytes;
  }
};

std::vector<std::string> payloads(const std::string& bytes) {
  const log::MemorySource source(bytes);
  log::StreamReader reader(source);
  std::vector<std::string> all;
  while (const log::Record* r = reader.next()) {
    if (const auto* m = std::get_if<log::Message>(r)) all.emplace_back(m->data);
  }
  return all;
}

TEST(Recording, MessagesOfOneGraphTimeAreSortedByNodeWhateverTheirWay) {
  Recorder a, b;
  const std::vector<Recorded> camera{recording_message("cam", 1, 10, "1"),
                                     recording_message("cam", 2, 10, "2")};
  const std::vector<Recorded> arm{recording_message("arm", 1, 10, "0"),
                                  recording_message("arm", 2, 20, "3")};
  for (const auto& [recorder, order] :
       {std::pair{&a, std::pair{camera, arm}}, {&b, {arm, camera}}}) {
    for (const Recorded& m : order.first) recorder->recording.add(m, kRecordingStart, false);
    recorder->advance(kRecordingStart + 10ms);
    for (const Recorded& m : order.second) {
      recorder->recording.add(m, kRecordingStart + 20ms, false);
    }
  }
  const std::string first = a.finish();
  EXPECT_EQ(payloads(first), (std::vector<std::string>{"0", "1", "2", "3"}));
  EXPECT_EQ(b.finish(), first);  // the whole file, byte by byte
}

TEST(Recording, AKilledRecorderHasLostAtMostATenthOfASecond) {
  Recorder r;
  r.recording.add(recording_message("a", 1, 10), kRecordingStart, false);
  r.advance(kRecordingStart + Recording::kHold);
  r.advance(kRecordingStart + Recording::kHold + RecordFile::kChunkPeriod - 1ms);
  EXPECT_EQ(payloads(r.bytes).size(), 0u);
  r.advance(kRecordingStart + 100ms);
  EXPECT_EQ(payloads(r.bytes).size(), 1u);
}

TEST(Recording, CountsWhatIsMissing) {
  Recorder r;
  for (const std::uint64_t seq : {5, 6, 6, 9}) {  // late start, repetition of a latched one, gap
    r.recording.add(recording_message("a", seq, seq), kRecordingStart, false);
  }
  EXPECT_EQ(r.recording.counts().total.received, 3u);
  EXPECT_EQ(r.recording.counts().total.lost, 2u);
  Recorded restarted = recording_message("a", 2, 10);  // its first is missing
  restarted.start_id = 77;
  r.recording.add(restarted, kRecordingStart, true);
  EXPECT_EQ(r.recording.counts().total.lost, 3u);
  r.recording.add(recording_message("b", 3, 10), kRecordingStart,
                  true);  // started after the recorder
  EXPECT_EQ(r.recording.counts().total.lost, 5u);
  const std::string bytes = r.finish();
  const log::MemorySource source(bytes);
  const auto summary = log::summarize(source);
  ASSERT_TRUE(summary);
  const auto counts = log::read_metadata(source, summary->metadata.at(0));
  ASSERT_TRUE(counts);
  EXPECT_EQ(counts->metadata.at("a/out (a)"), "received=4 lost=3");
  EXPECT_EQ(counts->metadata.at("total"), "received=5 lost=5");
  // A node that restarted has a channel of its own.
  std::vector<std::string> starts;
  for (const auto& [id, channel] : summary->channels) {
    if (channel.topic == "a/out") starts.push_back(channel.metadata.at("start_id"));
  }
  EXPECT_EQ(starts, (std::vector<std::string>{"0", "77"}));
}

TEST(TopicFilter, NamesExpressionsAndExclusions) {
  EXPECT_TRUE(TopicFilter({}, "", "")("camera/image"));
  const TopicFilter some({"a/b"}, "camera/.*", ".*/log");
  EXPECT_TRUE(some("a/b"));
  EXPECT_TRUE(some("camera/image"));
  EXPECT_FALSE(some("camera/log"));
  EXPECT_FALSE(some("a/bc"));
  EXPECT_THROW(TopicFilter({}, "(", ""), ConfigError);
}

}  // namespace
}  // namespace mimesis::tool
