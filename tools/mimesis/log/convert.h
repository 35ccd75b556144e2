#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "proto/can.pb.h"
#include "tools/mimesis/log/new_log.h"

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

/// One line of can-utils: of a log (`candump -l`, `-L`): "(1436509052.249713) vcan0
/// 044#2A366C2BBA", with "##" and flags for CAN FD, "#R" for remote requests; or as candump shows
/// it on a terminal: "  vcan0  044   [5]  2A 36 6C 2B BA", with or without a time. The header of
/// the frame stays empty.
struct CandumpLine {
  std::optional<std::uint64_t> time_ns;  ///< nothing: the line has none
  v1::CanFrame frame;
};

/// Nothing for lines without a frame: empty ones, and what `candump -e` explains. The reason of a
/// failure says what was expected where.
tl::expected<std::optional<CandumpLine>, Status> parse_candump(std::string_view line);

/// A line of a log, as `candump -l` writes it, without its end. Times are cut to microseconds.
std::string candump_line(std::uint64_t time_ns, const v1::CanFrame& frame);

}  // namespace mimesis::tool
