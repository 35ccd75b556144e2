#pragma once
#include <cstdint>
#include <string>

namespace mimesis::log {

/// Something in a file that is not as it should be.
struct Damage {
  std::uint64_t offset = 0;  ///< in the file [bytes]
  std::string what;          ///< what was expected, what is there, what it costs
  bool operator==(const Damage&) const = default;
};

struct ReaderLimits {
  std::uint64_t record_size = 1ull << 30;  ///< larger records are skipped and reported [bytes]
  std::uint64_t chunk_size = 1ull << 30;   ///< the same for what a chunk says it unpacks to [bytes]
  std::size_t damages = 1000;              ///< so many are described, the rest is counted
  bool threads = true;                     ///< read and unpack ahead; false: in the caller's thread
};

}  // namespace mimesis::log
