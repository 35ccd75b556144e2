#pragma once
#include <chrono>
#include <cstddef>
#include <string>
#include <string_view>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// Copies the lines of a node to a file, which ends at 64 MiB, and with the node's name in front to
/// our standard error: all of them, or none, or those that are no information of its log, at most
/// 500 a second: who prints more would wait for the terminal. Writes that fail are given up
/// silently: a full disk or a closed terminal must not stop the robot's launcher.
class LineLog {
 public:
  enum class Shown { all, no_information, none };

  /// @throws std::runtime_error if the file cannot be opened.
  LineLog(const std::string& name, const std::string& file, Shown shown);
  ~LineLog() { tell_held(); }
  LineLog(const LineLog&) = delete;
  LineLog& operator=(const LineLog&) = delete;

  void take(const std::string& text, bool error);
  /// The last line on standard error that is no information of a node's log, empty before there is
  /// one: often the reason why a node ended.
  const std::string& last_error() const { return last_error_; }

 private:
  void show(std::string_view text);
  bool too_many();
  void tell_held();

  std::string prefix_;
  Shown shown_;
  Fd file_;
  std::size_t written_ = 0;
  std::chrono::steady_clock::time_point second_{};  ///< its end
  std::size_t shown_in_second_ = 0, held_ = 0;
  std::string last_error_;
};

}  // namespace mimesis::launch
