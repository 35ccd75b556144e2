#pragma once
#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <optional>
#include <ostream>
#include <sstream>
#include <vector>

#include "common/time.h"
#include "tools/mimesis/human.h"
#include "tools/mimesis/log/record_file.h"
#include "tools/mimesis/table.h"

// A recorder watches its own end, publishers that are silent, and how the recording stands.
namespace mimesis::tool {

/// Decides when to stop listening after the signal to stop: when no message published before it has
/// come for a while, even if the graph continues to publish.
class Drain {
 public:
  /// After this time without an old message no more are expected.
  static constexpr std::chrono::milliseconds kQuiet{100};
  /// Publishers that are further behind are not waited for.
  static constexpr std::chrono::seconds kAtMost{2};

  /// Begins at the signal.
  Drain(WallTime now, std::uint64_t wall_ns) : begin_(now), last_old_(now), wall_ns_(wall_ns) {}

  /// A message has come. `graph_time`: `time_ns` is a simulated time, else that of the wall clock.
  void received(WallTime now, bool graph_time, std::uint64_t time_ns) {
    // Simulated time at the signal is unknown: messages right behind it are counted in.
    if (graph_time && now - begin_ < kQuiet) graph_ns_ = std::max(graph_ns_, time_ns);
    const bool unknown = !graph_time && time_ns == 0;
    if (!unknown && time_ns <= (graph_time ? graph_ns_ : wall_ns_)) last_old_ = now;
  }
  bool over(WallTime now) const { return now - last_old_ >= kQuiet || now - begin_ >= kAtMost; }
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
  std::vector<std::string> silent(const Counts& counts, const Now& now) {
    std::vector<std::string> topics;
    for (auto& [key, met] : met_) {
      if (met.settled || (met.graph_time ? now.graph : now.wall) < met.since + kPatience) continue;
      met.settled = true;
      if (!counts.topics.contains(key)) topics.push_back(key.first + " (" + key.second + ")");
    }
    return topics;
  }

 private:
  struct Met {
    bool graph_time;
    std::chrono::nanoseconds since;
    bool settled;  ///< reported as silent, or received
  };
  std::map<TopicAndNode, Met> met_;
};

/// How a recording stands.
struct RecordState {
  const Counts& counts;
  std::string file;              ///< file being written, or another state
  std::uint64_t bytes = 0;       ///< size of all files of the recording
  std::uint64_t free_bytes = 0;  ///< on the disk
};

struct TerminalSize {
  std::size_t rows = 24, columns = 80;
};
/// Size of standard error; nothing if it is no terminal.
inline std::optional<TerminalSize> terminal_size() {
  struct winsize size {};
  if (isatty(STDERR_FILENO) != 1) return std::nullopt;
  if (ioctl(STDERR_FILENO, TIOCGWINSZ, &size) != 0 || size.ws_row == 0) return TerminalSize{};
  return TerminalSize{size.ws_row, size.ws_col};
}

/// Shows how a recording stands: a table refreshed in place on a terminal, else a line now and
/// then.
class CountsDisplay {
 public:
  static constexpr std::chrono::seconds kTablePeriod{1}, kLinePeriod{10};

  CountsDisplay(std::ostream& out, WallTime start) : out_(out), shown_(start) {}

  /// If it is time. `terminal`: its size, or nothing if there is none.
  void show(const RecordState& state, const std::optional<TerminalSize>& terminal, WallTime now) {
    if (now < shown_ + (terminal ? kTablePeriod : kLinePeriod)) return;
    const double seconds = to_seconds(now - shown_);
    const std::string text = terminal ? table(state, *terminal, seconds) : line(state, seconds);
    clear();
    out_ << text << std::flush;
    if (terminal) lines_ = static_cast<std::size_t>(std::ranges::count(text, '\n'));
    shown_ = now;
    before_ = state.counts;
  }
  /// Takes the table away: before other lines are printed, and at the end.
  void clear() {
    if (lines_ > 0) out_ << fmt::format("\033[{}A\033[J", lines_) << std::flush;
    lines_ = 0;
  }

 private:
  std::string line(const RecordState& state, double seconds) const {
    const LossCount& total = state.counts.total;
    return fmt::format("{}: {} messages ({:.0f}/s), {} lost, {}, {} free\n", state.file,
                       total.received,
                       static_cast<double>(total.received - before_.total.received) / seconds,
                       total.lost, bytes_text(state.bytes), bytes_text(state.free_bytes));
  }
  std::string table(const RecordState& state, const TerminalSize& size, double seconds) const {
    constexpr std::size_t kOtherLines = 4;  // heading, topics left out, total, cursor
    const std::size_t rows = size.rows > kOtherLines ? size.rows - kOtherLines : 0;
    Table cells({"TOPIC", "NODE", "RECEIVED", "LOST", "HZ"});
    std::size_t shown = 0;
    for (const auto& [key, count] : state.counts.topics) {
      if (shown++ == rows) break;
      const auto before = before_.topics.find(key);
      const std::uint64_t fresh =
          count.received - (before == before_.topics.end() ? 0 : before->second.received);
      cells.row({key.first, key.second, std::to_string(count.received), std::to_string(count.lost),
                 fmt::format("{:.1f}", static_cast<double>(fresh) / seconds)});
    }
    std::ostringstream text;
    cells.print(text, false);
    if (const std::size_t topics = state.counts.topics.size(); topics > rows) {
      text << fmt::format("and {} more topics\n", topics - rows);
    }
    text << line(state, seconds);
    // A line that the terminal breaks would be two when it is taken away.
    std::string cut;
    std::istringstream lines(text.str());
    for (std::string l; std::getline(lines, l);) cut += l.substr(0, size.columns - 1) + '\n';
    return cut;
  }

  std::ostream& out_;
  WallTime shown_;
  std::size_t lines_ = 0;  ///< lines of the table on the screen
  Counts before_;          ///< when last shown
};

}  // namespace mimesis::tool
