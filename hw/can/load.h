#pragma once
#include <cstdint>

namespace mimesis::hw::can {

/// Bits of a classic frame with an 11-bit identifier and `bytes` of data on the wire, with the
/// three bits before the next frame: start 1, identifier and control 18, data, CRC 15, and 13 that
/// are never stuffed. [Bosch CAN 2.0, 3.1]
constexpr int least_bits(int bytes) { return 47 + 8 * bytes; }

/// The same with the most stuff bits: the first 34 + 8n bits can hold one after every fifth bit,
/// and after each fourth from then on, since a stuff bit counts: ⌊(34 + 8n − 1)/4⌋.
constexpr int worst_bits(int bytes) { return least_bits(bytes) + (34 + 8 * bytes - 1) / 4; }

}  // namespace mimesis::hw::can
