// Damaged files: every delivered message was written, and every missing one is reported.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/log/indexed_reader.h"
#include "common/log/test/campaign.h"
#include "common/log/test/sample_log.h"

namespace mimesis::log {
namespace {

constexpr std::uint32_t kCount = 1000;
constexpr std::size_t kChunk = 4096;
constexpr Compression kCodecs[] = {Compression::none, Compression::lz4, Compression::zstd};

TEST(Damage, EveryFlippedByteIsReportedOrHarmless) {
  for (const Compression codec : kCodecs) flip_bytes({codec, kChunk, 200}, 100, 11);
  flip_bytes({Compression::none, 0, 200}, 100, 12);
}

TEST(Damage, TruncatedLogsGiveWhatIsCompleteAndSayWhereTheyEnd) {
  for (const Compression codec : kCodecs) EXPECT_GT(truncate({codec, kChunk, 2000}, 60, 13), 0.97);
  EXPECT_EQ(truncate({Compression::none, 0, 200}, 60, 14), 1.0);
}

TEST(Damage, ZerosAfterAPowerCutAreNoMessages) {
  for (const Compression codec : kCodecs) blank_the_end({codec, kChunk, 500}, 60, 15);
}

TEST(Damage, OfACutSummaryNoDefinitionCounts) {
  const std::string good = sample_log(20, Compression::none, kChunk);
  const std::uint64_t summary = summarize(MemorySource(good))->start;
  ASSERT_GT(summary, 0U);
  for (std::size_t cut = summary + 1; cut < good.size(); ++cut) {
    const Outcome outcome = read_indexed(good.substr(0, cut) + std::string(600, '\0'));
    EXPECT_EQ(outcome.messages.size(), 20U) << "cut at " << cut << " of " << good.size();
    EXPECT_FALSE(outcome.damages.empty());
  }
}

TEST(Damage, OfACutChunkTheBeginningIsSavedAndSaidToBeUnchecked) {
  for (const Compression codec : kCodecs) {
    const std::string good = sample_log(20'000, codec, 1 << 20);
    const MemorySource source(good);
    const std::uint64_t second = summarize(source)->segments[1].index.chunk_start_offset;
    const std::size_t first_has = read_streamed(good.substr(0, second)).messages.size();
    const Outcome outcome = read_streamed(good.substr(0, second + 250'000));
    EXPECT_GT(outcome.messages.size(), first_has + 1500) << wire_name(codec);
    EXPECT_EQ(outcome.altered, 0u);
    ASSERT_EQ(outcome.damages.size(), 1u);
    EXPECT_EQ(outcome.damages[0].offset, second);
    const std::string saved = std::to_string(outcome.messages.size() - first_has);
    EXPECT_TRUE(outcome.damages[0].what.ends_with(
        ": its first " + saved + " messages are saved, their sum cannot be checked"))
        << outcome.damages[0].what;
  }
}

TEST(Damage, OfAChunkInTheMiddleWhoseSumFailsNothingIsSaved) {
  const std::string good = sample_log(kCount, Compression::none, kChunk);
  const MemorySource source(good);
  const auto summary = summarize(source);
  ASSERT_TRUE(summary);
  std::string bad = good;
  const ChunkIndex& chunk = summary->segments[3].index;
  bad[chunk.chunk_start_offset + chunk.chunk_length - 1] ^=
      1;  // in the payload of its last message
  const Outcome outcome = read_streamed(bad);
  const std::size_t lost = kCount - outcome.messages.size();
  EXPECT_GT(lost, 20u);
  EXPECT_EQ(outcome.altered, 0u);
  EXPECT_EQ(read_indexed(bad).messages, outcome.messages);
}

TEST(Damage, ThreadsFindTheSameAsOneThread) {
  std::mt19937 random(3);
  for (const Compression codec : kCodecs) {
    std::string file = sample_log(30'000, codec, 16 * 1024);
    for (int i = 0; i < 30; ++i) file[random() % file.size()] ^= 0x10;
    const Outcome alone = read_streamed(file, {.threads = false}), together = read_streamed(file);
    EXPECT_TRUE(together.same_content(alone));
    EXPECT_EQ(together.damages, alone.damages);
    EXPECT_GE(alone.damages.size(), 20u);
    EXPECT_GT(alone.messages.size(), 15'000u);
  }
}

TEST(Damage, AReaderMayBeLeftInTheMiddle) {
  const std::string file = sample_log(30'000, Compression::zstd, 16 * 1024);
  const MemorySource source(file);
  const auto summary = summarize(source);
  ASSERT_TRUE(summary);
  for (const int count : {1, 2000, 10'000}) {
    StreamReader streamed(source);
    IndexedReader indexed(source, *summary);
    for (int i = 0; i < count; ++i) ASSERT_TRUE(streamed.next() && indexed.next());
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
  const Outcome outcome = read_streamed(bad);
  EXPECT_EQ(outcome.altered, 0u);
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
  const Outcome outcome = read_streamed(file);
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
