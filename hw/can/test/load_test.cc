// Lengths of frames against frames that are built and stuffed bit by bit.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "hw/can/bus.h"

namespace mimesis::hw::can {
namespace {

/// Bits of a frame on the wire, with its stuff bits and the three of the gap. [Bosch CAN 2.0]
int bits_on_wire(std::uint32_t id, const std::vector<std::uint8_t>& data) {
  std::vector<bool> bits;
  const auto put = [&](std::uint32_t value, int count) {
    for (int i = count - 1; i >= 0; --i) bits.push_back((value >> i & 1u) != 0);
  };
  put(0, 1);  // start
  put(id, 11);
  put(0, 3);  // remote request, identifier extension, reserved
  put(static_cast<std::uint32_t>(data.size()), 4);
  for (const std::uint8_t byte : data) put(byte, 8);
  std::uint32_t crc = 0;
  for (const bool bit : bits) {
    const bool top = ((crc >> 14 & 1u) != 0) != bit;
    crc = (crc << 1 & 0x7FFF) ^ (top ? 0x4599u : 0u);
  }
  put(crc, 15);
  int stuffed = 0, run = 0;
  bool last = true;
  for (const bool bit : bits) {
    run = bit == last ? run + 1 : 1;
    last = bit;
    if (run == 5) {
      ++stuffed;
      last = !bit;  // the stuff bit begins a run
      run = 1;
    }
  }
  return static_cast<int>(bits.size()) + stuffed + 1 + 2 + 7 + 3;  // delimiter, ack, end, gap
}

TEST(Load, BoundsOfTheTableInTheLiterature) {
  const std::tuple<int, int, int> rows[] = {{0, 47, 55}, {1, 55, 65}, {6, 95, 115}, {8, 111, 135}};
  for (const auto& [bytes, least, worst] : rows) {
    EXPECT_EQ(least_bits(bytes), least);
    EXPECT_EQ(worst_bits(bytes), worst);
  }
}

TEST(Load, EveryFrameIsWithinItsBounds) {
  std::mt19937_64 random(7);
  for (int bytes = 0; bytes <= 8; ++bytes) {
    int longest = 0, shortest = 1000;
    for (int k = 0; k < 20'000; ++k) {
      std::vector<std::uint8_t> data(static_cast<std::size_t>(bytes));
      // Runs of equal bits stuff most: bytes of all zeros, all ones, and such as 0x78.
      for (std::uint8_t& byte : data) {
        constexpr std::uint8_t kLong[] = {0x00, 0xFF, 0x0F, 0x1E, 0x3C,
                                          0x78, 0xF0, 0xE1, 0xC3, 0x87};
        byte = k % 2 == 0 ? static_cast<std::uint8_t>(random()) : kLong[random() % 10];
      }
      const int bits = bits_on_wire(static_cast<std::uint32_t>(random() & 0x7FF), data);
      longest = std::max(longest, bits);
      shortest = std::min(shortest, bits);
    }
    EXPECT_LE(longest, worst_bits(bytes)) << bytes;
    EXPECT_GE(shortest, least_bits(bytes)) << bytes;
    EXPECT_LE(shortest, least_bits(bytes) + 2) << bytes << ": the bound is close";
  }
  EXPECT_GE(bits_on_wire(0, std::vector<std::uint8_t>(8, 0)), least_bits(8) + 16);
}

}  // namespace
}  // namespace mimesis::hw::can
