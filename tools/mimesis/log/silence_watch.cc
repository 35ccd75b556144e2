#include "tools/mimesis/log/silence_watch.h"

namespace mimesis::tool {

std::vector<std::string> SilenceWatch::silent(const Counts& counts, const Now& now) {
  std::vector<std::string> topics;
  for (auto& [key, met] : met_) {
    if (met.settled || (met.graph_time ? now.graph : now.wall) < met.since + kPatience) continue;
    met.settled = true;
    if (!counts.topics.contains(key)) topics.push_back(key.first + " (" + key.second + ")");
  }
  return topics;
}

}  // namespace mimesis::tool
