#pragma once
#include <cstdint>
#include <map>
#include <string_view>

#include "common/log/records.h"

namespace mimesis::log {

/// The usable beginning of a chunk whose sum cannot be checked.
struct Salvage {
  std::size_t bytes = 0;
  std::uint64_t messages = 0;
};

/// `records`: the readable beginning of a cut chunk. Takes records as long as they are whole and
/// possible: messages of channels that are known or defined in it, with log times within the range
/// in the chunk's head.
Salvage salvage(std::string_view records, const Chunk& head,
                const std::map<std::uint16_t, Channel>& known);

/// Size of `bytes` without the zeros at its end: they were never written before the power failed.
std::size_t without_zeros(std::string_view bytes);

}  // namespace mimesis::log
