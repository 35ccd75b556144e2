// Whatever happens to a file: what is delivered was written, and what is missing is told.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/log/indexed_reader.h"
#include "common/log/test/sample_log.h"

namespace mimesis::log {
namespace {

constexpr std::uint32_t kCount = 1000;
constexpr std::size_t kChunk = 4096;
constexpr Compression kCodecs[] = {Compression::none, Compression::lz4, Compression::zstd};

struct Outcome {
  std::vector<std::uint32_t> messages;  ///< index of the sample; the order of the file
  bool altered = false;                 ///< something was delivered that was never written
  std::vector<Damage> damages;
};

Outcome read(const std::string& file) {
  const MemorySource source(file);
  StreamReader reader(source);
  Outcome outcome;
  while (const Record* record = reader.next()) {
    if (const auto* m = std::get_if<Message>(record)) {
      const std::uint32_t i = 2 * (m->sequence - 1) + (m->channel_id - 1);
      outcome.altered |= i >= kCount || sample(*m) != sample_message(i);
      outcome.messages.push_back(i);
    } else if (const auto* a = std::get_if<Attachment>(record)) {
      outcome.altered |= a->data != "nodes: {}";
    }
  }
  outcome.damages = reader.damages();
  return outcome;
}

TEST(Damage, EveryFlippedByteInChunkedLogsIsReportedAndNoAlteredMessageDelivered) {
  for (const Compression codec : kCodecs) {
    const std::string good = sample_log(kCount, codec, kChunk);
    std::mt19937 random(static_cast<unsigned>(codec));
    double recovered = 0.0;
    constexpr int kFlips = 400;
    for (int i = 0; i < kFlips; ++i) {
      std::string bad = good;
      const std::size_t at = random() % bad.size();
      bad[at] = static_cast<char>(bad[at] ^ static_cast<char>(1 + random() % 255));
      const Outcome outcome = read(bad);
      ASSERT_FALSE(outcome.altered) << "byte " << at;
      ASSERT_FALSE(outcome.damages.empty()) << "byte " << at;
      ASSERT_TRUE(std::ranges::is_sorted(outcome.messages, std::less_equal{})) << "byte " << at;
      recovered += static_cast<double>(outcome.messages.size()) / kCount / kFlips;
    }
    EXPECT_GT(recovered, 0.93);  // one of 20 chunks is lost at a time, rarely two
  }
}

TEST(Damage, FlipsOutsideOfChunksAreReportedAtTheLatestBySumOfTheData) {
  const std::string good = sample_log(kCount, Compression::none, 0);
  std::mt19937 random(1);
  for (int i = 0; i < 400; ++i) {
    std::string bad = good;
    const std::size_t at = random() % bad.size();
    bad[at] = static_cast<char>(bad[at] ^ static_cast<char>(1 + random() % 255));
    ASSERT_FALSE(read(bad).damages.empty()) << "byte " << at;
  }
}

TEST(Damage, TruncatedLogsGiveEveryCompleteChunkAndSayWhereTheyEnd) {
  for (const Compression codec : kCodecs) {
    const std::string good = sample_log(kCount, codec, kChunk);
    const MemorySource source(good);
    // Where each chunk ends, and how many messages the file holds up to there.
    std::vector<std::size_t> ends, counts;
    StreamReader reader(source);
    std::size_t count = 0;
    while (const Record* record = reader.next()) {
      if (!std::holds_alternative<Message>(*record)) continue;
      const std::size_t end = reader.offset() + reader.length();
      if (ends.empty() || ends.back() != end) {
        ends.push_back(end);
        counts.push_back(count);
      }
      counts.back() = ++count;
    }
    ASSERT_EQ(count, kCount);
    std::mt19937 random(7);
    for (int i = 0; i < 300; ++i) {
      const std::size_t size = kMagic.size() + 1 + random() % (good.size() - kMagic.size() - 1);
      const Outcome outcome = read(good.substr(0, size));
      std::size_t complete = 0;
      for (std::size_t k = 0; k < ends.size() && ends[k] <= size; ++k) complete = counts[k];
      EXPECT_EQ(outcome.messages.size(), complete) << size;
      ASSERT_FALSE(outcome.altered);
      ASSERT_EQ(outcome.damages.size(), 1u) << size;
      EXPECT_LE(outcome.damages[0].offset, size);
      for (std::size_t k = 0; k < outcome.messages.size(); ++k) ASSERT_EQ(outcome.messages[k], k);
    }
  }
}

TEST(Damage, ReadingGoesOnBehindADamagedLength) {
  const std::string good = sample_log(kCount, Compression::zstd, kChunk);
  const MemorySource source(good);
  const auto summary = summarize(source);
  ASSERT_TRUE(summary);
  ASSERT_GT(summary->segments.size(), 5u);
  const std::uint64_t third = summary->segments[2].index.chunk_start_offset;
  const std::uint64_t fourth = summary->segments[3].index.chunk_start_offset;
  std::string bad = good;
  bad[third + 7] = '\x40';  // longer than any file
  const Outcome outcome = read(bad);
  EXPECT_FALSE(outcome.altered);
  EXPECT_GT(outcome.messages.size(), kCount * 8 / 10);
  ASSERT_FALSE(outcome.damages.empty());
  EXPECT_EQ(outcome.damages[0].offset, third);
  EXPECT_NE(outcome.damages[0].what.find("reading goes on at " + std::to_string(fourth)),
            std::string::npos)
      << outcome.damages[0].what;
}

TEST(Damage, TheIndexedReaderLeavesOutTheBadChunkAndSaysSo) {
  std::string file = sample_log(kCount, Compression::lz4, kChunk);
  const MemorySource source(file);
  const auto summary = summarize(source);
  ASSERT_TRUE(summary);
  const ChunkIndex& chunk = summary->segments[2].index;
  file[chunk.chunk_start_offset + chunk.chunk_length - 20] ^= 1;
  IndexedReader reader(source, *summary);
  std::uint32_t count = 0;
  while (reader.next() != nullptr) ++count;
  EXPECT_LT(count, kCount);
  EXPECT_GT(count, kCount * 9 / 10);
  ASSERT_EQ(reader.damages().size(), 1u);
  EXPECT_EQ(reader.damages()[0].offset, chunk.chunk_start_offset);
}

TEST(Damage, LyingSizesCostNoMemory) {
  std::string file = sample_log(10, Compression::zstd, kChunk);
  const MemorySource source(file);
  const auto summary = summarize(source);
  ASSERT_TRUE(summary);
  const std::size_t size_at = summary->segments[0].index.chunk_start_offset + kRecordHead + 16;
  file[size_at + 7] = '\x7f';  // "unpacks to exabytes"
  const Outcome outcome = read(file);
  ASSERT_FALSE(outcome.damages.empty());
  EXPECT_NE(outcome.damages[0].what.find("the limit is"), std::string::npos);
}

/// Random edits of many bytes, insertions and cuts: readers must survive, under sanitizers too.
TEST(Damage, RandomMutationsNeverBreakTheReaders) {
  std::mt19937 random(42);
  std::vector<std::string> good;
  for (const Compression codec : kCodecs) good.push_back(sample_log(60, codec, 1000));
  good.push_back(sample_log(60, Compression::none, 0));
  for (std::size_t i = 0; i < 3'000; ++i) {
    std::string file = good[i % good.size()];
    for (unsigned edits = 1 + random() % 8; edits > 0; --edits) {
      const std::size_t at = random() % file.size();
      const std::size_t length = std::min<std::size_t>(random() % 16, file.size() - at);
      switch (random() % 5) {
        case 0:
          file[at] = static_cast<char>(random());
          break;
        case 1:
          file[at] = '\xff';
          break;
        case 2:
          file.erase(at, length);
          break;
        case 3:
          file.insert(at, file.substr(random() % file.size(), length));
          break;
        default:
          file.replace(at, length, std::string(length, static_cast<char>(random() % 16)));
      }
      if (file.empty()) file = "x";
    }
    const MemorySource source(file);
    StreamReader reader(source);
    std::uint64_t records = 0;
    while (reader.next() != nullptr) ASSERT_LT(++records, 10'000u);
    if (const auto summary = summarize(source)) {
      IndexedReader indexed(source, *summary);
      while (indexed.next() != nullptr) ASSERT_LT(++records, 100'000u);
    }
  }
}

}  // namespace
}  // namespace mimesis::log
