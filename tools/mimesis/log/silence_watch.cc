#include "tools/mimesis/log/silence_watch.h"

namespace mimesis::tool {

std::vector<std::string> SilenceWatch::silent(const Counts& counts, WallTime now) {
  std::vector<std::string> topics;
  for (auto& [key, met] : met_) {
    if (met.told || now < met.since + kPatience) continue;
    met.told = true;  // told now, or heard: either way it is settled
    if (!counts.topics.contains(key)) topics.push_back(key.first + " (" + key.second + ")");
  }
  return topics;
}

}  // namespace mimesis::tool
