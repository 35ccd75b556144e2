// The parts of the paced player that need neither graph nor clock.
#include "tools/mimesis/log/play_parts.h"

#include <gtest/gtest.h>

#include <atomic>

#include "common/log/writer.h"
#include "tools/mimesis/log/playback.h"

namespace mimesis::tool {
namespace {

using namespace std::chrono_literals;
using runtime::Time;
using Wall = PlayTimeline::Wall;

TEST(PlayTimeline, RunsAtItsRateAndStands) {
  PlayTimeline t(2.0);
  t.jump(Wall(10s), 100s);
  EXPECT_EQ(t.at(Wall(15s)), 100s);  // stands
  t.run(Wall(20s));
  EXPECT_EQ(t.at(Wall(21s)), 102s);
  EXPECT_EQ(t.due(103s), Wall(21'500ms));
  t.set_rate(Wall(21s), 0.5);
  EXPECT_EQ(t.at(Wall(21s)), 102s);  // no jump
  EXPECT_EQ(t.at(Wall(23s)), 103s);
  EXPECT_EQ(t.due(104s), Wall(25s));
  t.stand(Wall(23s));
  EXPECT_EQ(t.at(Wall(99s)), 103s);
  t.run(Wall(99s));
  EXPECT_EQ(t.at(Wall(101s)), 104s);
  t.jump(Wall(101s), 7s);
  EXPECT_EQ(t.at(Wall(103s)), 8s);
  t.set_rate(Wall(103s), 1e-3);
  EXPECT_GT(t.due(Time::max()), Wall(103s));  // no overflow
}

TEST(PlayLateness, QuantilesAreAtMostThreePerCentTooHigh) {
  PlayLateness late;
  EXPECT_EQ(late.quantile(0.5), 0ns);
  for (int i = 1; i <= 1000; ++i) late.add(std::chrono::microseconds(i));
  EXPECT_EQ(late.count(), 1000U);
  EXPECT_EQ(late.worst(), 1ms);
  for (const double share : {0.001, 0.1, 0.5, 0.99}) {
    const double exact_s = share * 1e-3, found_s = runtime::to_seconds(late.quantile(share));
    EXPECT_GE(found_s, exact_s) << share;
    EXPECT_LE(found_s, 1.032 * exact_s) << share;
  }
  EXPECT_EQ(late.quantile(1.0), 1ms);  // never more than the worst
}

TEST(PlayLateness, SmallOnesAreExactAndExtremesAreCounted) {
  PlayLateness late;
  late.add(-5ns);
  EXPECT_EQ(late.quantile(1.0), 0ns);
  late.add(63ns);
  EXPECT_EQ(late.quantile(1.0), 63ns);
  late.add(Time::max());
  EXPECT_EQ(late.worst(), Time::max());
  EXPECT_EQ(late.quantile(0.5), 63ns);
  EXPECT_EQ(late.count(), 3U);
}

/// A log of `count` messages of `size` bytes, 1 ms apart, that say their number.
std::string make_log(std::uint32_t count, std::size_t size) {
  std::string bytes;
  log::MemorySink sink(bytes);
  log::Writer writer(sink, {.compression = log::Compression::none});
  const auto schema = *writer.add_schema("test.Type", "protobuf", "");
  const auto channel = *writer.add_channel(schema, "out", "protobuf", {});
  for (std::uint32_t i = 0; i < count; ++i) {
    std::string payload = std::to_string(i);
    payload.resize(size, '.');
    EXPECT_TRUE(writer.write({channel, i + 1, 1'000'000ULL * i, 0, payload}));
  }
  EXPECT_TRUE(writer.finish());
  return bytes;
}

std::vector<OpenLog> opened(const std::string& bytes) {
  std::vector<OpenLog> all;
  auto source = std::make_unique<log::MemorySource>(bytes);
  auto summary = log::summarize(*source);
  all.push_back({"memory", std::move(source), *summary});
  return all;
}

class PlayAheadOf : public ::testing::TestWithParam<std::pair<std::size_t, PlayAheadLimits>> {};

TEST_P(PlayAheadOf, DeliversAllInOrderAndAgainAfterASeek) {
  const auto& [size, limits] = GetParam();
  const std::string bytes = make_log(5000, size);
  Playback playback(opened(bytes), {});
  std::atomic<int> arrivals{0};
  PlayAhead ahead(playback, limits, [&] {
    ++arrivals;
    arrivals.notify_one();
  });
  for (const std::uint64_t first : {0, 3000, 1}) {
    ahead.seek(1'000'000 * first);
    std::uint64_t expected = first;
    while (!ahead.ended()) {
      const int seen = arrivals;
      const Played* next = ahead.front();
      if (next == nullptr) {
        if (!ahead.ended()) arrivals.wait(seen);  // it would hang without a call
        continue;
      }
      ASSERT_EQ(next->payload.size(), size);
      ASSERT_EQ(std::stoul(next->payload), expected);
      ASSERT_EQ(next->log_time_ns, 1'000'000 * expected);
      ++expected;
      ahead.pop();
    }
    EXPECT_EQ(expected, 5000U);
    EXPECT_EQ(ahead.front(), nullptr);
  }
  ahead.seek(0);  // seeks while reading
}

INSTANTIATE_TEST_SUITE_P(
    Limits, PlayAheadOf,
    ::testing::Values(std::pair{std::size_t{16}, PlayAheadLimits{}},
                      std::pair{std::size_t{2000}, PlayAheadLimits{}},
                      std::pair{std::size_t{2000}, PlayAheadLimits{.seconds = 0.001}},
                      std::pair{std::size_t{2000}, PlayAheadLimits{.bytes = 1}}));

/// Counts the bytes read from it.
class CountingSource final : public log::Source {
 public:
  explicit CountingSource(std::string_view bytes) : source_(bytes) {}
  std::uint64_t size() const override { return source_.size(); }
  tl::expected<std::size_t, Status> read(std::uint64_t offset, char* out,
                                         std::size_t size) const override {
    count += size;
    return source_.read(offset, out, size);
  }
  mutable std::atomic<std::size_t> count{0};

 private:
  log::MemorySource source_;
};

TEST(PlayAhead, ReadsNoFurtherThanItMay) {
  constexpr std::size_t kMegabyte = 1'000'000;
  const std::string bytes = make_log(5000, 2 * kMegabyte / 1000);
  const auto summary = log::summarize(log::MemorySource(bytes));
  ASSERT_TRUE(summary);
  for (const PlayAheadLimits limits :
       {PlayAheadLimits{.bytes = kMegabyte}, PlayAheadLimits{.seconds = 0.5}}) {
    std::vector<OpenLog> logs;
    auto counting = std::make_unique<CountingSource>(bytes);
    const CountingSource& counted = *counting;
    logs.push_back({"memory", std::move(counting), *summary});
    Playback playback(std::move(logs), {});
    std::atomic<bool> called{false};
    PlayAhead ahead(playback, limits, [&] {
      called = true;
      called.notify_one();
    });
    ahead.seek(0);
    called.wait(false);
    EXPECT_TRUE(ahead.full());
    EXPECT_LT(counted.count, 4 * kMegabyte);  // the bound, a batch and a chunk
    while (!ahead.ended()) {
      if (ahead.front() != nullptr) ahead.pop();
    }
    EXPECT_GT(counted.count, 10 * kMegabyte);
  }
}

}  // namespace
}  // namespace mimesis::tool
