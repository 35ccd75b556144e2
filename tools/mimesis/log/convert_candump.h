#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <tl/expected.hpp>

#include "common/error.h"
#include "proto/can.pb.h"

namespace mimesis::tool {

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
