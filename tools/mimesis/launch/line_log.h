#pragma once
#include <string>
#include <string_view>

#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {

/// What a node writes to its standard output and error: line by line to a file, and with the node's
/// name in front to our standard error. Bounded: a line of more than 4 KiB is broken, the file ends
/// at 64 MiB.
class LineLog {
 public:
  /// @throws std::runtime_error if the file cannot be opened.
  LineLog(const std::string& name, const std::string& file);

  /// Takes what is readable (at most 256 KiB, so that others get their turn); closes `from` at its
  /// end.
  void pump(Fd& from, std::string& partial);
  /// Streams of one child; their lines do not mix.
  void pump(Child& child);
  /// Writes out a last line without its end.
  void flush();
  /// The last line on standard error, empty before there is one: why a node ended, if it says so.
  const std::string& last_error() const { return last_error_; }

 private:
  void take(std::string& partial);
  void line(std::string_view text);

  std::string prefix_;
  Fd file_;
  std::size_t written_ = 0;
  std::string out_, err_;  // begun lines
  std::string last_error_;
};

}  // namespace mimesis::launch
