#pragma once
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <iosfwd>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/mimesis/log/recording.h"

namespace mimesis::tool {

/// When to stop listening after the signal to stop: as soon as nothing that was published before it
/// has come for a while, however much the graph goes on talking.
class Drain {
 public:
  using WallTime = std::chrono::steady_clock::time_point;
  /// Without an old message for so long, none is under way any more.
  static constexpr std::chrono::milliseconds kQuiet{100};
  /// Publishers that are further behind are not waited for.
  static constexpr std::chrono::seconds kAtMost{2};

  /// Begins at the signal.
  Drain(WallTime now, std::uint64_t wall_ns) : begin_(now), last_old_(now), wall_ns_(wall_ns) {}

  /// A message has come. `graph_time`: `time_ns` is a simulated time, else that of the wall clock.
  void received(WallTime now, bool graph_time, std::uint64_t time_ns);
  bool over(WallTime now) const;
  /// It is over because of kAtMost: what else was published before the signal is unknown.
  bool gave_up(WallTime now) const { return now - last_old_ < kQuiet; }

 private:
  WallTime begin_, last_old_;
  std::uint64_t wall_ns_;
  std::uint64_t graph_ns_ = 0;  ///< the latest simulated time that began before or with the signal
};

/// Finds topics that have a publisher but bring no message.
class SilenceWatch {
 public:
  /// Longest silence in the publisher's own time: a graph that waits for its last node, or that is
  /// simulated slowly, is not silent.
  static constexpr std::chrono::seconds kPatience{2};

  /// Now on the wall's clock and on the graph's; the latter 0 until it runs.
  struct Now {
    std::chrono::nanoseconds wall, graph;
  };

  /// A publisher is there and ready; the first call in a running graph counts.
  void met(const std::string& topic, const std::string& node, bool graph_time, const Now& now) {
    if (graph_time && now.graph.count() == 0) return;
    met_.try_emplace({topic, node}, Met{graph_time, graph_time ? now.graph : now.wall, false});
  }
  /// "TOPIC (NODE)" of those that have been silent for too long, each once.
  std::vector<std::string> silent(const Counts& counts, const Now& now);

 private:
  struct Met {
    bool graph_time;
    std::chrono::nanoseconds since;
    bool settled;  ///< told, or heard
  };
  std::map<std::pair<std::string, std::string>, Met> met_;
};

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
/// Size of standard error; nothing if it is no terminal.
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
