#include "tools/mimesis/log/elided_payload.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <optional>

namespace mimesis::tool {
namespace {

/// Takes a varint off the front; nothing if there is none.
std::optional<std::uint64_t> take_varint(std::string_view& bytes) {
  std::uint64_t value = 0;
  for (unsigned shift = 0; shift < 64 && !bytes.empty(); shift += 7) {
    const auto byte = static_cast<std::uint8_t>(bytes.front());
    bytes.remove_prefix(1);
    value |= std::uint64_t{byte & 0x7Fu} << shift;
    if ((byte & 0x80u) == 0) return value;
  }
  return std::nullopt;
}

/// Size of a field's value behind its tag [bytes]; nothing if it does not end.
std::optional<std::size_t> value_size(unsigned wire_type, std::string_view bytes) {
  const std::size_t before = bytes.size();
  if (wire_type == 1) return 8;
  if (wire_type == 5) return 4;
  if (wire_type != 0 && wire_type != 2) return std::nullopt;  // groups: not in proto3
  const auto value = take_varint(bytes);
  if (!value || (wire_type == 2 && *value > bytes.size())) return std::nullopt;
  return before - bytes.size() + (wire_type == 2 ? *value : 0);
}

/// All words are mixed in by an odd factor, so that each bit of the input counts (after xxHash).
std::uint64_t sum_of(std::string_view bytes) {
  constexpr std::uint64_t kA = 0x9E3779B185EBCA87ull, kB = 0xC2B2AE3D27D4EB4Full;
  std::uint64_t sum = kB ^ bytes.size();
  for (std::size_t at = 0; at < bytes.size(); at += 8) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data() + at, std::min<std::size_t>(8, bytes.size() - at));
    sum = std::rotl(sum ^ (word * kB), 27) * kA + 1;
  }
  sum = (sum ^ (sum >> 33)) * kB;
  return sum ^ (sum >> 29);
}

}  // namespace

std::string elide(std::string_view payload) {
  std::string small;
  for (std::string_view rest = payload; !rest.empty();) {
    const std::string_view field = rest;
    const auto tag = take_varint(rest);
    const auto size = tag ? value_size(static_cast<unsigned>(*tag & 7u), rest) : std::nullopt;
    if (!size || *size > rest.size()) return std::string(payload);
    const std::size_t whole = field.size() - rest.size() + *size;
    if (whole < kLargeField) small += field.substr(0, whole);
    rest.remove_prefix(*size);
  }
  constexpr std::string_view kTag = "\xF9\xFF\xFF\xFF\x0F";  // 536870911 << 3 | 1: eight bytes
  const std::uint64_t sum = sum_of(payload);
  small += kTag;
  return small.append(reinterpret_cast<const char*>(&sum), sizeof sum);
}

}  // namespace mimesis::tool
