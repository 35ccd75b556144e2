#pragma once
#include <string>

#include "common/log/writer.h"

namespace mimesis::tool {

/// What a file holds, told by its first bytes.
enum class LogKind { mcap, candump, lcm };

/// @throws ConfigError for other kinds: it names what they are and who converts them.
LogKind detect_kind(const log::Source& source, const std::string& path);

struct ConvertOptions {
  std::string input = {};
  std::string output = {};  ///< "-": standard output, for candump
  std::string from = {};    ///< "candump" or "lcm" instead of detection
  bool force = false;       ///< replace the output if it exists
  log::Compression compression = log::Compression::zstd;
};

struct ConvertResult {
  LogKind from = LogKind::mcap;
  std::uint64_t messages = 0;
  std::uint64_t damages = 0;  ///< lines or places that could not be read; each was said
  std::uint64_t lost = 0;     ///< LCM: events dropped by the logger, told by their numbers
  std::uint64_t untimed = 0;  ///< candump: lines without a time, which took that of the line before
};

/// candump -> MCAP: mimesis.v1.CanFrame on can/INTERFACE. LCM -> MCAP: the payloads as they are,
/// encoding "lcm", the type's fingerprint as metadata of the channel. MCAP -> candump: all messages
/// of type mimesis.v1.CanFrame.
/// @throws ConfigError if the input is of no such kind or the output cannot be written.
ConvertResult convert_log(const log::Source& source, const ConvertOptions& options);

/// `mimesis log convert`: 0, or 1 if something could not be read.
int log_convert(const ConvertOptions& options, bool json);

}  // namespace mimesis::tool
