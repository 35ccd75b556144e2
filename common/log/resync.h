#pragma once
#include <cstdint>
#include <optional>

#include "common/log/io.h"

namespace mimesis::log {

/// The first offset >= `from` where a Chunk or DataEnd record is certain to start: all lengths in
/// its head agree with each other and with the size of the file. O(size) once.
std::optional<std::uint64_t> find_record(Window& window, std::uint64_t file_size,
                                         std::uint64_t from);

}  // namespace mimesis::log
