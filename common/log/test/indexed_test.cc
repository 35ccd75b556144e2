#include <gtest/gtest.h>

#include <algorithm>

#include "common/log/indexed_reader.h"
#include "common/log/test/sample_log.h"

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

}  // namespace
}  // namespace mimesis::log
