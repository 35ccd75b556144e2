#pragma once
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "tools/mimesis/log/recording.h"

namespace mimesis::tool {

/// How a recording stands.
struct RecordState {
  const Counts& counts;
  std::string file;              ///< being written, or what is going on instead
  std::uint64_t bytes = 0;       ///< of all files of the recording
  std::uint64_t free_bytes = 0;  ///< on the disk
};

struct TerminalSize {
  std::size_t rows = 24, columns = 80;
};
/// Of standard error; nothing if it is no terminal.
std::optional<TerminalSize> terminal_size();

/// Shows how a recording stands: a table refreshed in place on a terminal, else a line now and
/// then.
class CountsDisplay {
 public:
  static constexpr std::chrono::seconds kTablePeriod{1}, kLinePeriod{10};

  CountsDisplay(std::ostream& out, WallTime start) : out_(out), shown_(start) {}

  /// If it is time. `terminal`: its size, or nothing if there is none.
  void show(const RecordState& state, const std::optional<TerminalSize>& terminal, WallTime now);
  /// Takes the table away: before other lines are printed, and at the end.
  void clear();

 private:
  std::string line(const RecordState& state, double seconds) const;
  std::string table(const RecordState& state, const TerminalSize& size, double seconds) const;

  std::ostream& out_;
  WallTime shown_;
  std::size_t lines_ = 0;  ///< of the table on the screen
  std::map<std::pair<std::string, std::string>, std::uint64_t>
      before_;  ///< received when last shown
  std::uint64_t total_before_ = 0;
};

}  // namespace mimesis::tool
