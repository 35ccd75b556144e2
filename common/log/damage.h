#pragma once
#include <cstdint>
#include <string>

namespace mimesis::log {

/// Something in a file that is not as it should be.
struct Damage {
  std::uint64_t offset = 0;  ///< in the file [bytes]
  std::string what;          ///< what was expected, what was found, what is lost
  bool operator==(const Damage&) const = default;
};

struct ReaderLimits {
  std::uint64_t record_size = 1ull << 30;  ///< larger records are skipped and reported [bytes]
  std::uint64_t chunk_size = 1ull << 30;   ///< largest unpacked size that a chunk may claim [bytes]
  /// largest number of damages that are described; more are counted
  std::size_t damages = 1000;
  bool threads = true;  ///< read and unpack ahead; false: in the caller's thread
};

}  // namespace mimesis::log
