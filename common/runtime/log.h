#pragma once
#include <fmt/core.h>

#include <chrono>
#include <string>
#include <string_view>
#include <vector>

namespace mimesis::runtime {

enum class Level { debug, info, warn, error };

/// Writes one line to the node's logger (standard error, and topic NODE/log as foxglove.Log). For
/// .cc files of nodes and hw, never of algorithms; state changes only: what happens every cycle is
/// a message.
void log(Level level, std::string_view line);

/// log() of a text that fmt formats.
template <class... Args>
void info(fmt::format_string<Args...> format, Args&&... args) {
  log(Level::info, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void warn(fmt::format_string<Args...> format, Args&&... args) {
  log(Level::warn, fmt::format(format, std::forward<Args>(args)...));
}
template <class... Args>
void error(fmt::format_string<Args...> format, Args&&... args) {
  log(Level::error, fmt::format(format, std::forward<Args>(args)...));
}

/// Passes one line per period and counts the suppressed ones. One per place that can flood.
class Throttle {
 public:
  explicit Throttle(std::chrono::milliseconds period) : period_(period) {}
  /// True if the line may be written now (wall time).
  bool pass();
  std::uint64_t held_back() const { return held_back_; }  ///< since the last line that passed

 private:
  std::chrono::milliseconds period_;
  std::chrono::steady_clock::time_point next_{};
  std::uint64_t held_back_ = 0, counting_ = 0;
};

/// One line that was logged.
struct LogLine {
  Level level = Level::info;
  std::string text;
};

/// Name in front of every line of this process on standard error.
void set_log_name(std::string_view name);

/// Lines below this level are written nowhere.
void set_log_level(Level least);

/// Keeps one text for topic NODE/log that is too long for standard error: the parameters.
void record(std::string_view text);

/// Lines since the last call, for publication by the node's own thread: a logger may be called
/// anywhere, a socket may not. At most 256 are kept, the newest ones.
std::vector<LogLine> take_log_lines();

}  // namespace mimesis::runtime
