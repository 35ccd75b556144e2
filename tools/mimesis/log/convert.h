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

/// Kind of a file, by its first bytes.
enum class LogKind { mcap, candump };

/// @throws ConfigError for other kinds: it names the kind and its converter.
LogKind detect_kind(const log::Source& source, const std::string& path);

struct ConvertOptions {
  std::string input = {};
  OutputOptions output = {};  ///< path "-": standard output, for candump
  bool candump = false;       ///< without detection
  bool rosbag2 = false;       ///< MCAP to a folder of rosbag2
  std::string compression = "zstd";
  bool json = false;
};

struct ConvertResult {
  LogKind from = LogKind::mcap;
  std::uint64_t messages = 0;
  std::uint64_t damages = 0;  ///< lines or places that could not be read; each was reported
  std::uint64_t untimed = 0;  ///< lines without a time, which took that of the line before
  std::vector<std::string> left_out = {};  ///< topics that ROS has no type for
};

/// candump -> MCAP: mimesis.v1.CanFrame on can/INTERFACE. MCAP -> candump: all messages of type
/// mimesis.v1.CanFrame.
/// MCAP -> a bag of ROS 2 (metadata.yaml and FOLDER_0.mcap, profile ros2, CDR): the messages that
/// ros_type() knows, transforms on /tf, others on /TOPIC.
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

/// Empty for lines without a frame: empty ones, and explanations of `candump -e`. The reason of a
/// failure names the place and the expected text.
tl::expected<std::optional<CandumpLine>, Status> parse_candump(std::string_view line);

/// A line of a log, as `candump -l` writes it, without its end. Times are cut to microseconds.
std::string candump_line(std::uint64_t time_ns, const v1::CanFrame& frame);

}  // namespace mimesis::tool
