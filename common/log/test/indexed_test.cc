#include <gtest/gtest.h>

#include <algorithm>

#include "common/log/indexed_reader.h"
#include "common/log/test/sample_log.h"
#include "common/log/wire.h"

namespace mimesis::log {
namespace {

std::vector<SampleMessage> read(const std::string& file, Selection selection = {}) {
  const MemorySource source(file);
  const auto summary = summarize(source);
  EXPECT_TRUE(summary);
  IndexedReader reader(source, *summary, std::move(selection));
  std::vector<SampleMessage> all;
  while (const Message* m = reader.next()) all.push_back(sample(*m));
  EXPECT_TRUE(reader.damages().empty());
  return all;
}

/// A log of `times`, in this order, three messages per chunk; sequence is the place in the file.
std::string log_of(const std::vector<std::uint64_t>& times) {
  std::string out;
  MemorySink sink(out);
  Writer writer(sink, {});
  EXPECT_TRUE(writer.add_channel(0, "t", "", {}));
  for (std::uint32_t i = 0; i < times.size(); ++i) {
    EXPECT_TRUE(writer.write({1, i, times[i], 0, "x"}));
    if (i % 3 == 2) {
      EXPECT_TRUE(writer.flush());
    }
  }
  EXPECT_TRUE(writer.finish());
  return out;
}

TEST(IndexedReader, MergesOverlappingChunksAndKeepsTheFilesOrderOfEqualTimes) {
  const std::vector<std::uint64_t> times{5, 1, 5, 3, 5, 1, 9, 0, 5, 5, 5, 5};
  std::vector<std::uint32_t> expected(times.size());
  for (std::uint32_t i = 0; i < expected.size(); ++i) expected[i] = i;
  std::ranges::stable_sort(expected, {}, [&](std::uint32_t i) { return times[i]; });
  std::vector<std::uint32_t> order;
  for (const auto& m : read(log_of(times))) order.push_back(m.sequence);
  EXPECT_EQ(order, expected);
}

TEST(IndexedReader, DeliversTheSameWithAndWithoutASummary) {
  for (const std::size_t chunk_size : {0, 4096}) {
    const std::string file = sample_log(3000, Compression::zstd, chunk_size);
    const auto whole = read(file);
    ASSERT_EQ(whole.size(), 3000u);
    EXPECT_TRUE(std::ranges::is_sorted(whole, {}, &SampleMessage::log_time));
    const std::string killed = file.substr(0, file.size() - kFooterSize);
    EXPECT_EQ(read(killed), whole);
  }
}

TEST(IndexedReader, SelectsTopicsAndTimes) {
  const std::string file = sample_log(3000, Compression::lz4, 4096);
  Selection selection;
  selection.channel = [](const Channel& c) { return c.topic == "b/out"; };
  selection.start_time = 5000;
  selection.end_time = 9000;
  std::vector<SampleMessage> expected;
  for (const auto& m : read(file)) {
    if (m.channel_id == 2 && m.log_time >= 5000 && m.log_time < 9000) expected.push_back(m);
  }
  ASSERT_GT(expected.size(), 100u);
  EXPECT_EQ(read(file, selection), expected);
}

TEST(Summary, ReadsAttachmentsAndMetadataByIndex) {
  std::string file = sample_log(100, Compression::zstd, 4096);
  const MemorySource source(file);
  const auto summary = summarize(source);
  ASSERT_TRUE(summary);
  EXPECT_TRUE(summary->from_file);
  EXPECT_EQ(summary->header.library, "mimesis");
  EXPECT_EQ(summary->statistics.channel_message_counts.at(1), 50u);
  std::string data;
  ASSERT_EQ(summary->attachments.size(), 1u);
  ASSERT_TRUE(read_attachment(source, summary->attachments[0], data));
  EXPECT_EQ(data, "nodes: {}");
  ASSERT_EQ(summary->metadata.size(), 1u);
  EXPECT_EQ(read_metadata(source, summary->metadata[0])->metadata.at("a/out"), "0");

  file[file.find("nodes: {}")] = 'N';
  const auto damaged = read_attachment(source, summary->attachments[0], data);
  ASSERT_FALSE(damaged);
  EXPECT_NE(damaged.error().reason.find("'launch.yaml': its CRC-32 does not fit"),
            std::string::npos);
}

TEST(Summary, RefusesWhatIsNoLog) {
  for (const std::string& text :
       {std::string(), std::string("x"), std::string("nodes: {camera: {}}\n")}) {
    const MemorySource source(text);
    const auto summary = summarize(source);
    ASSERT_FALSE(summary);
    EXPECT_EQ(summary.error().reason,
              "not an MCAP log: the file does not start as an MCAP log does");
  }
}

/// Bytes of a record.
template <class... Fields>
std::string record_of(Opcode opcode, const Fields&... fields) {
  std::string out;
  {
    const RecordFrame frame(out, static_cast<char>(opcode));
    (put(out, fields), ...);
  }
  return out;
}

/// A chunk that defines channel 1 as `topic` and holds one message of it.
std::string chunk_of(const std::string& topic, std::uint64_t time) {
  using Pairs = std::map<std::string, std::string>;
  const std::string message =
      record_of(Opcode::message, std::uint16_t{1}, std::uint32_t{0}, time, time);
  const std::string inside = record_of(Opcode::channel, std::uint16_t{1}, std::uint16_t{0}, topic,
                                       std::string("raw"), Pairs{}) +
                             message;
  std::string out;
  {
    const RecordFrame frame(out, static_cast<char>(Opcode::chunk));
    for (const std::uint64_t n : {time, time, std::uint64_t{inside.size()}}) put(out, n);
    put(out, std::uint32_t{0});
    put(out, std::string());
    put(out, std::uint64_t{inside.size()});
    out += inside;
  }
  return out;
}

/// A message never goes by a topic that is not its own.
TEST(Indexed, AnIdThatIsTwoChannelsIsRefusedNotGuessed) {
  const std::string first = chunk_of("/a", 1), second = chunk_of("/b", 2);
  const std::string head =
      std::string(kMagic) + record_of(Opcode::header, std::string(), std::string());
  const std::string file =
      head + first + second + record_of(Opcode::data_end, std::uint32_t{0}) +
      record_of(Opcode::footer, std::uint64_t{0}, std::uint64_t{0}, std::uint32_t{0}) +
      std::string(kMagic);
  const MemorySource source(file);
  const auto refused = summarize(source);
  ASSERT_FALSE(refused);
  EXPECT_EQ(
      refused.error().reason,
      "byte " + std::to_string(head.size() + first.size()) +
          ": id 1 is defined a second time, differently: `mimesis log recover` takes both apart");

  Summary summary;  // as if the file's own named the second one alone
  summary.channels[1] = {1, 0, "/b", "raw", {}};
  for (const auto& [offset, chunk, time] :
       {std::tuple(head.size(), first, 1U), std::tuple(head.size() + first.size(), second, 2U)}) {
    Segment& segment = summary.segments.emplace_back();
    segment.index.chunk_start_offset = offset;
    segment.index.chunk_length = chunk.size();
    segment.index.message_start_time = segment.index.message_end_time = time;
  }
  IndexedReader reader(source, summary);
  const Message* message = reader.next();
  ASSERT_NE(message, nullptr);
  EXPECT_EQ(message->log_time, 2U);
  EXPECT_EQ(reader.next(), nullptr);
  ASSERT_EQ(reader.damages().size(), 1U);
  EXPECT_NE(reader.damages()[0].what.find("channel 1 is '/a' in it, '/b' in the summary"),
            std::string::npos)
      << reader.damages()[0].what;
}

}  // namespace
}  // namespace mimesis::log
