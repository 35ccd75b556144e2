#include "common/log/test/campaign.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <random>

#include "common/log/stream_reader.h"
#include "common/log/test/sample_log.h"

namespace mimesis::log {
namespace {

std::string name(const Victim& v) {
  return fmt::format("{:4} chunks of {:5}", v.chunk_size == 0 ? "" : wire_name(v.codec),
                     v.chunk_size);
}

/// Where a message ends: alone (`packed` is exact), or in the chunk around it.
struct Place {
  std::uint64_t packed_begin, packed_end;  ///< in the file
  std::uint64_t end, size;                 ///< in the unpacked records, and of all of them
};

std::vector<Place> places(const std::string& file) {
  std::vector<Place> all;
  const MemorySource source(file);
  StreamReader reader(source);
  std::uint64_t chunk_at = 0, unpacked = 0;
  while (const Record* record = reader.next()) {
    const auto* message = std::get_if<Message>(record);
    const std::uint64_t end = reader.offset() + reader.length();
    if (const Chunk* chunk = reader.chunk()) {
      if (reader.offset() != chunk_at) unpacked = 0;
      chunk_at = reader.offset();
      std::string bytes;
      if (message) append(bytes, *message);
      if (const auto* schema = std::get_if<Schema>(record)) append(bytes, *schema);
      if (const auto* channel = std::get_if<Channel>(record)) append(bytes, *channel);
      unpacked += bytes.size();
      if (message) {
        all.push_back({end - chunk->records.size(), end, unpacked, chunk->uncompressed_size});
      }
    } else if (message) {
      all.push_back({reader.offset(), end, 1, 1});
    }
  }
  return all;
}

bool complete(const Place& place, std::uint64_t size) {
  if (size <= place.packed_begin) return false;
  const double there = static_cast<double>(std::min(size, place.packed_end) - place.packed_begin) /
                       static_cast<double>(place.packed_end - place.packed_begin);
  return static_cast<double>(place.end) <= there * static_cast<double>(place.size) + 1e-6;
}

/// Samples 0, 1, 2, ... unaltered.
void expect_beginning(const Outcome& outcome, std::size_t at_least, const std::string& where) {
  ASSERT_EQ(outcome.altered, 0u) << where;
  ASSERT_GE(outcome.messages.size(), at_least) << where;
  for (std::size_t k = 0; k < outcome.messages.size(); ++k)
    ASSERT_EQ(outcome.messages[k], k) << where;
}

std::size_t in_whole_chunks(const std::vector<Place>& all, std::uint64_t size) {
  return static_cast<std::size_t>(
      std::ranges::count_if(all, [&](const Place& p) { return p.packed_end <= size; }));
}

}  // namespace

void flip_bytes(const Victim& victim, int flips, unsigned seed) {
  const std::string good = sample_log(victim.messages, victim.codec, victim.chunk_size);
  const Outcome streamed = read_streamed(good), indexed = read_indexed(good);
  ASSERT_TRUE(streamed.damages.empty() && indexed.damages.empty());
  ASSERT_EQ(streamed.messages.size(), victim.messages);
  std::mt19937 random(seed);
  int reported = 0, reported_by_index = 0;
  double recovered = 0.0;
  for (int i = 0; i < flips; ++i) {
    std::string bad = good;
    const std::size_t at = random() % bad.size();
    bad[at] = static_cast<char>(bad[at] ^ static_cast<char>(1 + random() % 255));
    const std::string where = fmt::format("{}, byte {}", name(victim), at);
    const Outcome s = read_streamed(bad), x = read_indexed(bad);
    ASSERT_TRUE(!s.damages.empty() || s.same_content(streamed)) << where;
    ASSERT_TRUE(!x.damages.empty() || x.same_content(indexed)) << where;
    ASSERT_TRUE(victim.chunk_size == 0 || s.altered + x.altered == 0) << where;
    reported += !s.damages.empty();
    reported_by_index += !x.damages.empty();
    recovered += static_cast<double>(s.messages.size()) / victim.messages / flips;
  }
  fmt::print(
      "{}: {} flips, streamed: {} reported, {} harmless; by index: {} reported, {} harmless; "
      "{:.2f} % of the messages delivered\n",
      name(victim), flips, reported, flips - reported, reported_by_index, flips - reported_by_index,
      100 * recovered);
}

double truncate(const Victim& victim, int cuts, unsigned seed) {
  const std::string good = sample_log(victim.messages, victim.codec, victim.chunk_size);
  const std::vector<Place> all = places(good);
  EXPECT_EQ(all.size(), victim.messages);
  std::mt19937 random(seed);
  std::uint64_t expected = 0, recovered = 0;
  for (int i = 0; i < cuts && !::testing::Test::HasFatalFailure(); ++i) {
    const std::size_t size = kMagic.size() + 1 + random() % (good.size() - kMagic.size() - 1);
    const std::string where = fmt::format("{}, cut at {}", name(victim), size);
    const std::string cut = good.substr(0, size);
    const Outcome s = read_streamed(cut), x = read_indexed(cut);
    expect_beginning(s, in_whole_chunks(all, size), where);
    EXPECT_EQ(s.damages.size(), 1u) << where;
    EXPECT_EQ(x.messages, s.messages) << where;
    EXPECT_EQ(x.altered, 0u) << where;
    EXPECT_FALSE(x.damages.empty()) << where;
    const auto whole =
        std::ranges::count_if(all, [&](const Place& p) { return complete(p, size); });
    expected += static_cast<std::uint64_t>(whole);
    recovered += std::min<std::uint64_t>(s.messages.size(), static_cast<std::uint64_t>(whole));
  }
  const double share = static_cast<double>(recovered) / static_cast<double>(expected);
  fmt::print("{}: {} cuts of {} bytes, {:.2f} % of the complete messages recovered\n", name(victim),
             cuts, good.size(), 100 * share);
  return share;
}

void blank_the_end(const Victim& victim, int cuts, unsigned seed) {
  const std::string good = sample_log(victim.messages, victim.codec, victim.chunk_size);
  const std::vector<Place> all = places(good);
  std::mt19937 random(seed);
  for (int i = 0; i < cuts; ++i) {
    const std::size_t size = kMagic.size() + 1 + random() % (good.size() - kMagic.size() - 1);
    // Up to the end of the file that should have become, or less, or more.
    const std::string bad = good.substr(0, size) + std::string(512 + random() % good.size(), '\0');
    const std::string where =
        fmt::format("{}, zeros from {} to {}", name(victim), size, bad.size());
    const Outcome s = read_streamed(bad), x = read_indexed(bad);
    expect_beginning(s, in_whole_chunks(all, size), where);
    EXPECT_EQ(x.messages, s.messages) << where;
    EXPECT_FALSE(s.damages.empty()) << where;
  }
}

}  // namespace mimesis::log
