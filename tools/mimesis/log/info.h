#pragma once
#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// One topic of one node, in all files together.
struct TopicSummary {
  std::string topic, type, node, encoding;
  std::map<std::string, std::string> metadata;  ///< of its first channel
  std::set<std::string> starts;                 ///< of the node, by start_id
  std::uint64_t messages = 0;
  std::optional<LossCount> losses;     ///< what the recorder counted
  std::optional<std::uint64_t> bytes;  ///< of payload, if asked for
};

struct NodeSummary {
  std::set<std::string> topics, starts;
  std::uint64_t messages = 0;
};

/// What one or several logs hold.
struct LogSummary {
  Span span;
  std::uint64_t messages = 0, size = 0;  ///< size of the files [bytes]
  std::uint64_t chunks = 0, compressed = 0, uncompressed = 0;
  std::set<std::string> compressions;
  std::vector<TopicSummary> topics;
  std::map<std::string, NodeSummary> nodes;
  std::vector<std::pair<std::string, std::map<std::string, std::string>>> metadata;  ///< each once
  std::optional<std::uint64_t> lost;  ///< sum; nothing if no recorder counted
  double duration_s() const;
  double rate_hz(const TopicSummary& topic) const;
};

/// `sizes`: reads all messages to sum their payloads per topic.
LogSummary summarize_logs(const std::vector<OpenLog>& logs, bool sizes);

nlohmann::ordered_json info_json(const std::vector<OpenLog>& logs, const LogSummary& summary);
std::string info_text(const std::vector<OpenLog>& logs, const LogSummary& summary, bool colour);

}  // namespace mimesis::tool
