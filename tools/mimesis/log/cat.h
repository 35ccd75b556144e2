#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

struct CatOptions {
  std::vector<std::string> files;
  TopicOptions topics;
  TimeRange range;
  std::vector<std::string> fields;   ///< only these; empty: the whole message
  std::string bytes = "length";      ///< how these look: length, base64 or hex
  std::uint64_t limit = 0;           ///< messages; 0: all
  std::string attachment, metadata;  ///< print these instead of messages
};

/// Takes text of several lines; throws VerbEnd to end the work (closed pipe, full disk).
using TextSink = std::function<void(std::string_view text)>;

/// One JSON object per message, in the order of log time. Returns the exit code.
int cat_messages(const std::vector<OpenLog>& logs, const CatOptions& options, const TextSink& sink);

}  // namespace mimesis::tool
