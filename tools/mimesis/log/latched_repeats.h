#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <tuple>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// Every part of a split recording begins with the last values of its latched topics. Finds these
/// repetitions where parts are read as one log.
class LatchedRepeats {
 public:
  /// True if the message before it of this topic, node and start was the same.
  bool repeated(const log::MergedReader::Item& item);

 private:
  struct Last {
    std::uint32_t sequence = 0;
    std::uint64_t publish_time = 0;
    std::uint32_t crc = 0;  ///< of the payload: nodes restart, numbers repeat
    bool operator==(const Last&) const = default;
  };
  std::map<const log::Channel*, Last*> channels_;
  std::map<std::tuple<std::string, std::string, std::string>, Last> last_;
};

}  // namespace mimesis::tool
