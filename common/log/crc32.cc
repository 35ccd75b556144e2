#include "common/log/crc32.h"

#include <libdeflate.h>
#include <zlib.h>

namespace mimesis::log {

std::uint32_t crc32(std::uint32_t crc, std::string_view bytes) {
  return ::libdeflate_crc32(crc, bytes.data(), bytes.size());
}

std::uint32_t crc32_join(std::uint32_t crc_a, std::uint32_t crc_b, std::uint64_t size_b) {
  return static_cast<std::uint32_t>(::crc32_combine(crc_a, crc_b, static_cast<z_off_t>(size_b)));
}

}  // namespace mimesis::log
