#pragma once
#include <set>
#include <string>
#include <vector>

#include "tools/mimesis/log/log_time.h"
#include "tools/mimesis/log/new_log.h"
#include "tools/mimesis/log/thinning.h"
#include "tools/mimesis/topic_filter.h"

namespace mimesis::tool {

struct FilterOptions {
  std::vector<std::string> inputs;
  OutputOptions output;
  std::vector<std::string> topics;  ///< as in TopicFilter
  std::string regex, exclude;
  std::vector<std::string> nodes;  ///< only what these published; empty: all
  std::string inputs_of;           ///< what a replay of this node needs
  TimeRange range;
  bool latched = true;                       ///< last values before the start, at its time
  std::vector<std::string> every, max_rate;  ///< as in Thinning
  bool attachments = true, metadata = true;
  std::vector<std::string> notes;  ///< KEY=VALUE, for metadata "mimesis.notes"
  bool json = false;
};

/// Topics that a replay of `node` needs, from the messages on NODE/start: what it reads and writes,
/// NODE/start and NODE/steps. Empty if the logs have no such message.
std::set<std::string> topics_for_replay(const std::vector<OpenLog>& logs, const std::string& node);

/// `mimesis log filter`. Returns the exit code. @throws ConfigError
int log_filter(FilterOptions options);

}  // namespace mimesis::tool
