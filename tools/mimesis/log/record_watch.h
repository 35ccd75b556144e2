#pragma once
#include <fmt/format.h>

#include <vector>

#include "common/time.h"
#include "tools/mimesis/human.h"
#include "tools/mimesis/log/record_file.h"
#include "tools/mimesis/progress.h"

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

/// A line that says how a recording stands, now and then.
class CountsLine {
 public:
  explicit CountsLine(WallTime start) : shown_(start) {}

  void show(const RecordState& state, WallTime now) {
    const LossCount& total = state.counts.total;
    const auto fresh = static_cast<double>(total.received - received_);
    if (!line_.show(fmt::format("{}: {} messages ({:.0f}/s), {} lost, {}, {} free", state.file,
                                total.received, fresh / to_seconds(now - shown_), total.lost,
                                bytes_text(state.bytes), bytes_text(state.free_bytes)),
                    now)) {
      return;
    }
    shown_ = now;
    received_ = total.received;
  }
  /// Takes the line away: before other lines are printed, and at the end.
  void clear() { line_.clear(); }

 private:
  StatusLine line_;
  WallTime shown_;
  std::uint64_t received_ = 0;  ///< when last shown
};

}  // namespace mimesis::tool
