#include "hw/can/testing/faulty_wire.h"

#include <gtest/gtest.h>

#include <bit>

namespace mimesis::hw::can {
namespace {

using namespace std::chrono_literals;

std::vector<Frame> numbered(int count) {
  std::vector<Frame> frames;
  for (int i = 0; i < count; ++i)
    frames.push_back({.id = static_cast<std::uint32_t>(i), .length = 8});
  return frames;
}

TEST(FaultyWire, CarriesWhatItIsGivenIfNothingIsWrong) {
  FaultyWire wire({}, 1);
  const std::vector<Frame> frames = numbered(100);
  EXPECT_EQ(wire.carry(1s, frames), frames);
  EXPECT_EQ(wire.damaged(), 0u);
}

TEST(FaultyWire, DamagesTheShareThatIsAsked) {
  constexpr int kFrames = 10'000;  // standard deviation of a share of 20 %: 0.4 %
  const std::vector<Frame> frames = numbered(kFrames);
  EXPECT_NEAR(static_cast<double>(FaultyWire({.lose = 0.2}, 2).carry(1s, frames).size()),
              0.8 * kFrames, 160);
  EXPECT_NEAR(static_cast<double>(FaultyWire({.duplicate = 0.2}, 2).carry(1s, frames).size()),
              1.2 * kFrames, 160);
  int flipped = 0;
  for (const Frame& f : FaultyWire({.corrupt = 0.2}, 2).carry(1s, frames)) {
    int bits = 0;
    for (const std::uint8_t byte : f.data) bits += std::popcount(byte);
    EXPECT_LE(bits, 1);
    flipped += bits;
  }
  EXPECT_NEAR(flipped, 0.2 * kFrames, 160);
}

TEST(FaultyWire, ADelayedFrameComesLaterAndOnce) {
  FaultyWire wire({.delay = 1.0, .delay_by = 30ms}, 3);
  EXPECT_TRUE(wire.carry(1s, numbered(3)).empty());
  wire.change({});
  EXPECT_EQ(wire.carry(1029ms, numbered(1)).size(), 1u) << "overtakes";
  EXPECT_EQ(wire.carry(1030ms, {}).size(), 3u);
  EXPECT_TRUE(wire.carry(2s, {}).empty());
}

TEST(FaultyWire, TheSameSeedIsTheSameDamage) {
  const WireFaults faults{
      .lose = 0.3, .duplicate = 0.2, .corrupt = 0.1, .delay = 0.1, .delay_by = 1ms};
  const auto run = [&](std::uint64_t seed) {
    return FaultyWire(faults, seed).carry(1s, numbered(500));
  };
  EXPECT_EQ(run(4), run(4));
  EXPECT_NE(run(4), run(5));
}

}  // namespace
}  // namespace mimesis::hw::can
