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
  static constexpr std::chrono::seconds kPatience{2};

  /// A publisher is there; the first call counts.
  void met(const std::string& topic, const std::string& node, WallTime now) {
    met_.try_emplace({topic, node}, Met{now, false});
  }
  /// "TOPIC (NODE)" of those that have been silent for too long, each once.
  std::vector<std::string> silent(const Counts& counts, WallTime now);

 private:
  struct Met {
    WallTime since;
    bool told;
  };
  std::map<std::pair<std::string, std::string>, Met> met_;
};

}  // namespace mimesis::tool
