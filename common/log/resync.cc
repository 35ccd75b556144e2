#include "common/log/resync.h"

#include <algorithm>

#include "common/log/codec.h"
#include "common/log/records.h"
#include "common/log/wire.h"

namespace mimesis::log {
namespace {

constexpr std::size_t kPiece = 64 * 1024;
constexpr std::size_t kDataEnd = kRecordHead + sizeof(std::uint32_t);
constexpr std::size_t kChunkHead =
    kRecordHead + 3 * 8 + 4 + 4 + 4 + 8;  // with the longest name, "lz4"/"zstd"

bool chunk_starts(std::string_view bytes, std::uint64_t left) {
  Decoder d(bytes);
  const auto opcode = d.integer<Opcode>();
  const auto length = d.integer<std::uint64_t>();
  if (opcode != Opcode::chunk || length > left - kRecordHead) return false;
  const auto start = d.integer<std::uint64_t>();
  const auto end = d.integer<std::uint64_t>();
  d.integer<std::uint64_t>();
  d.integer<std::uint32_t>();
  const std::string_view compression = d.string();
  const auto size = d.integer<std::uint64_t>();
  return d.ok() && start <= end && parse_compression(compression) &&
         length == 3 * 8 + 4 + 4 + compression.size() + 8 + size;
}

bool data_end_starts(std::string_view bytes, std::uint64_t left) {
  Decoder d(bytes);
  if (d.integer<Opcode>() != Opcode::data_end ||
      d.integer<std::uint64_t>() != sizeof(std::uint32_t)) {
    return false;
  }
  d.integer<std::uint32_t>();
  const std::uint64_t behind = left - std::min(left, std::uint64_t{kDataEnd});
  if (!d.ok() || behind < kRecordHead) return d.ok() && behind == 0;
  const auto opcode = d.integer<Opcode>();  // opcode of the summary, or the footer
  return opcode >= Opcode::footer && opcode <= Opcode::summary_offset &&
         opcode != Opcode::message && opcode != Opcode::chunk &&
         d.integer<std::uint64_t>() <= behind - kRecordHead;
}

}  // namespace

std::optional<std::uint64_t> find_record(Window& window, std::uint64_t file_size,
                                         std::uint64_t from) {
  while (from < file_size) {
    const auto bytes = window.view(from, kPiece + kChunkHead);
    if (!bytes || bytes->empty()) return std::nullopt;
    const std::size_t starts = bytes->size() <= kPiece ? bytes->size() : kPiece;
    for (std::size_t i = 0; i < starts; ++i) {
      const auto opcode = static_cast<Opcode>((*bytes)[i]);
      if (opcode != Opcode::chunk && opcode != Opcode::data_end) continue;
      const std::uint64_t left = file_size - from - i;
      if (left < kRecordHead) return std::nullopt;
      const std::string_view here = bytes->substr(i, kChunkHead);
      if (chunk_starts(here, left) || data_end_starts(here, left)) return from + i;
    }
    from += starts;
  }
  return std::nullopt;
}

}  // namespace mimesis::log
