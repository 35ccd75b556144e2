#pragma once
#include <cstddef>
#include <string>
#include <string_view>

#include "common/log/records.h"

// Messages that a log does not hold whole because their node computes them again, byte for byte
// (`mimesis log restore`): noise of a rendered camera cannot be compressed without loss.
namespace mimesis::tool {

/// Key in the metadata of a channel whose payloads are elided; value: how they come back.
inline constexpr const char* kElidedKey = "elided";

/// The same in logs of version 0.1.
inline constexpr const char* kFormerElidedKey = "reference";

/// Fields from this size on are left out [bytes].
inline constexpr std::size_t kLargeField = 4096;

/// A serialised message without its large `bytes`, `string` and message fields, followed by field
/// 536870911 with a 64-bit sum of all of it: still a message of its type for every reader. A
/// payload that is no Protobuf message stays whole. O(size), ~4 GB/s.
std::string elide(std::string_view payload);

inline bool is_elided(const log::Channel& channel) {
  return channel.metadata.contains(kElidedKey) || channel.metadata.contains(kFormerElidedKey);
}

}  // namespace mimesis::tool
