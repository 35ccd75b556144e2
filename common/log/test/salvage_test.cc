#include <gtest/gtest.h>

#include "common/log/codec.h"
#include "common/log/records.h"

namespace mimesis::log {
namespace {

const Chunk kHead{10, 20, 0, 0, "", ""};
const std::map<std::uint16_t, Channel> kKnown{{1, {1, 0, "t", "", {}}}};

std::string message(std::uint16_t channel, std::uint64_t log_time) {
  std::string bytes;
  append(bytes, Message{channel, 7, log_time, 0, "data"});
  return bytes;
}

TEST(Salvage, TakesWholeRecordsOfKnownChannelsWithinTheChunksTimes) {
  const std::string good = message(1, 10) + message(1, 20);
  const auto saved = [&](const std::string& next) {
    const Salvage s = salvage(good + next, kHead, kKnown);
    return std::pair(s.bytes - good.size(), s.messages);
  };
  const std::string another = message(1, 15);
  EXPECT_EQ(saved(another), std::pair(another.size(), std::uint64_t{3}));
  const std::pair nothing(std::size_t{0}, std::uint64_t{2});
  EXPECT_EQ(saved(another.substr(0, another.size() - 1)), nothing);
  EXPECT_EQ(saved(message(2, 15)), nothing);  // no such channel
  EXPECT_EQ(saved(message(1, 9)), nothing);
  EXPECT_EQ(saved(message(1, 21)), nothing);
  EXPECT_EQ(saved(std::string(100, '\0')), nothing);
  std::string metadata;
  append(metadata, Metadata{"no place for it", {}});
  EXPECT_EQ(saved(metadata), nothing);
}

TEST(Salvage, AChannelDefinedInTheChunkIsKnown) {
  std::string records;
  append(records, Channel{3, 0, "t", "", {}});
  records += message(3, 11);
  EXPECT_EQ(salvage(records, kHead, {}).messages, 1u);
  EXPECT_EQ(salvage(records, kHead, {}).bytes, records.size());
}

TEST(Salvage, ZerosAtTheEndWereNeverWritten) {
  using std::literals::operator""sv;
  EXPECT_EQ(without_zeros("a\0b\0\0"sv), 3u);
  EXPECT_EQ(without_zeros("\0\0"sv), 0u);
  EXPECT_EQ(without_zeros(""sv), 0u);
}

std::string half_random(std::size_t size) {
  std::string bytes(size, 'a');
  std::uint32_t random = 1;
  for (std::size_t i = 0; i < size; i += 2) {
    random = random * 1664525u + 1013904223u;
    bytes[i] = static_cast<char>(random >> 24);
  }
  return bytes;
}

TEST(Codec, TheBeginningOfAFrameGivesItsWholeBlocks) {
  const std::string bytes = half_random(1 << 20);
  for (const auto& [codec, block] : {std::pair(Compression::none, std::size_t{1}),
                                     std::pair(Compression::lz4, std::size_t{64 << 10}),
                                     std::pair(Compression::zstd, std::size_t{128 << 10})}) {
    Compressor compressor(codec);
    const std::string packed(*compressor.run(bytes));
    Decompressor decompressor;
    EXPECT_EQ(decompressor.run(codec, packed, bytes.size()), bytes);
    EXPECT_FALSE(decompressor.run(codec, packed, bytes.size() - 1));
    EXPECT_FALSE(decompressor.run(codec, packed, bytes.size() + 1));
    const std::string_view cut = std::string_view(packed).substr(0, packed.size() / 2);
    EXPECT_FALSE(decompressor.run(codec, cut, bytes.size()));
    const std::string_view half = decompressor.run_beginning(codec, cut, bytes.size());
    EXPECT_TRUE(bytes.starts_with(half));
    EXPECT_GE(half.size() + 2 * block, bytes.size() / 2);
  }
}

TEST(Codec, MemoryGrowsWithWhatArrivesNotWithWhatIsClaimed) {
  const std::string zeros(40 << 20, '\0');
  for (const auto codec : {Compression::lz4, Compression::zstd}) {
    Compressor compressor(codec);
    const std::string packed(*compressor.run(zeros));
    Decompressor decompressor;
    EXPECT_EQ(decompressor.run(codec, packed, zeros.size()), zeros);
    EXPECT_FALSE(decompressor.run(codec, packed, zeros.size() - 1));
    // More than any machine has: taken at its word it would end the program.
    EXPECT_FALSE(decompressor.run(codec, packed, std::size_t{1} << 60));
  }
}

}  // namespace
}  // namespace mimesis::log
