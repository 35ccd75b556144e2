#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "tools/mimesis/log/recording.h"

namespace mimesis::tool {

/// Finds topics that have a publisher but bring no message.
class SilenceWatch {
 public:
  /// Of the publisher's own time: a graph that waits for its last node, or that is simulated
  /// slowly, is not silent.
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

}  // namespace mimesis::tool
