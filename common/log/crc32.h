#pragma once
#include <cstdint>
#include <string_view>

namespace mimesis::log {

/// CRC-32 of `bytes` (reflected polynomial 0xEDB88320, as in zlib), continuing `crc`. Start with 0.
std::uint32_t crc32(std::uint32_t crc, std::string_view bytes);

/// CRC of A followed by B, from crc(A), crc(B) and |B|. O(log |B|): data is read once where two
/// sums cover it.
std::uint32_t crc32_join(std::uint32_t crc_a, std::uint32_t crc_b, std::uint64_t size_b);

}  // namespace mimesis::log
