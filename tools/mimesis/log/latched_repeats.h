#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <tuple>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// Metadata "latched" of a channel: late joiners get the last message.
bool is_latched(const log::Channel& channel);

/// Every part of a split recording begins with the last values of its latched topics. Finds these
/// repetitions where parts are read as one log.
class LatchedRepeats {
 public:
  /// True if a message of this topic, node and start with this sequence number came just before.
  bool repeated(const log::MergedReader::Item& item);

 private:
  std::map<const log::Channel*, std::uint32_t*> channels_;
  std::map<std::tuple<std::string, std::string, std::string>, std::uint32_t> last_;
};

}  // namespace mimesis::tool
