#pragma once
#include <cstdint>
#include <limits>
#include <string>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// Log time that people mean [ns]: "12.5" (seconds from the first message), "1795275600250000000ns"
/// (absolute), "2026-11-21T15:40:00.25Z" or "2026-11-21 15:40:00" (UTC).
/// @throws ConfigError that names `option`.
std::uint64_t parse_log_time(const std::string& option, const std::string& text, const Span& span);

/// A part of a log as the options --start, --end and --duration give it; "" is the whole.
struct TimeRange {
  std::string start = {}, end = {}, duration = {};
  bool whole() const { return start.empty() && end.empty() && duration.empty(); }
};

/// The log times [start_time, end_time) of `range`. @throws ConfigError
struct LogTimes {
  std::uint64_t start = 0, end = std::numeric_limits<std::uint64_t>::max();
};
LogTimes resolve(const TimeRange& range, const Span& span);

}  // namespace mimesis::tool
