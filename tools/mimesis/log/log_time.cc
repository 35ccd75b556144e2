#include "tools/mimesis/log/log_time.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <optional>

#include "common/error.h"
#include "common/runtime/value_text.h"

namespace mimesis::tool {
namespace {

constexpr double kLargest_s = 1e10;  // 300 years: no time in a log is later

std::optional<std::uint64_t> to_nanoseconds(std::string_view digits) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc{} || end != digits.data() + digits.size()) return std::nullopt;
  return value;
}

/// "2026-11-21T15:40:00.25Z", with ' ' for T, without fraction or Z.
std::optional<std::uint64_t> to_utc(const std::string& text) {
  int year = 0, month = 0, day = 0, hour = 0, minute = 0, used = 0;
  char between = 0;
  if (std::sscanf(text.c_str(), "%4d-%2d-%2d%c%2d:%2d:%n", &year, &month, &day, &between, &hour,
                  &minute, &used) != 6 ||
      used == 0 || (between != 'T' && between != ' ')) {
    return std::nullopt;
  }
  std::string seconds = text.substr(static_cast<std::size_t>(used));
  if (seconds.ends_with('Z')) seconds.pop_back();
  const auto second = runtime::to_double(seconds);
  using namespace std::chrono;
  const year_month_day date{std::chrono::year{year},
                            std::chrono::month(static_cast<unsigned>(month)),
                            std::chrono::day(static_cast<unsigned>(day))};
  if (!second || *second < 0.0 || *second >= 61.0 || !date.ok() || year < 1970 || hour > 23 ||
      minute > 59) {
    return std::nullopt;
  }
  const auto whole = sys_days(date).time_since_epoch() + hours(hour) + minutes(minute);
  return static_cast<std::uint64_t>(duration_cast<nanoseconds>(whole).count()) +
         static_cast<std::uint64_t>(std::llround(*second * 1e9));
}

/// "2.5", "500ms", "2min".
std::optional<std::uint64_t> seconds_ns(const std::string& text) {
  if (const auto duration = runtime::to_duration(text)) {
    return static_cast<std::uint64_t>(duration->count());
  }
  const auto seconds = runtime::to_double(text);
  if (!seconds || *seconds < 0.0 || *seconds > kLargest_s) return std::nullopt;
  return static_cast<std::uint64_t>(std::llround(*seconds * 1e9));
}

}  // namespace

std::uint64_t parse_log_time(const std::string& option, const std::string& text, const Span& span) {
  if (text.ends_with("ns")) {
    if (const auto ns = to_nanoseconds(std::string_view(text).substr(0, text.size() - 2))) {
      return *ns;
    }
  } else if (const auto ns = seconds_ns(text)) {
    return span.start_ns + *ns;
  } else if (const auto utc = to_utc(text)) {
    return *utc;
  }
  throw ConfigError(fmt::format(
      "{}: expected seconds from the first message (12.5), a log time (12500000000ns) or "
      "a time in UTC (2026-11-21T15:40:00.5Z), found '{}'",
      option, text));
}

LogTimes resolve(const TimeRange& range, const Span& span) {
  LogTimes times;
  if (!range.start.empty()) times.start = parse_log_time("--start", range.start, span);
  if (!range.end.empty()) times.end = parse_log_time("--end", range.end, span);
  if (!range.duration.empty()) {
    if (!range.end.empty()) throw ConfigError("give --end or --duration, not both");
    const auto ns = seconds_ns(range.duration);
    if (!ns) {
      throw ConfigError(fmt::format(
          "--duration: expected seconds (2.5) or a duration (2min), found '{}'", range.duration));
    }
    times.end = std::max(times.start, span.start_ns) + *ns;
  }
  if (times.end <= times.start) {
    throw ConfigError(
        fmt::format("the part of the log is empty: it starts at {} ns and ends at {} ns",
                    times.start, times.end));
  }
  return times;
}

}  // namespace mimesis::tool
