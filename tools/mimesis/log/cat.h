#pragma once
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "tools/mimesis/log/json_text.h"
#include "tools/mimesis/log/log_time.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/topic_filter.h"

namespace mimesis::tool {

struct CatOptions {
  std::vector<std::string> files;
  TopicFilter filter{{}, "", ""};
  TimeRange range;
  std::vector<std::string> fields;  ///< only these; empty: the whole message
  BytesText bytes = BytesText::length;
  std::uint64_t limit = 0;           ///< messages; 0: all
  std::string attachment, metadata;  ///< print these instead of messages
};

/// Takes text of several lines; a failure (closed pipe, full disk) ends the work.
using TextSink = std::function<log::Result(std::string_view text)>;

/// One JSON object per message, in the order of log time. Returns the exit code; `sink` failed: the
/// failure.
tl::expected<int, Status> cat_messages(const std::vector<OpenLog>& logs, const CatOptions& options,
                                       const TextSink& sink);

/// `mimesis log cat`: to standard output. Returns the exit code.
int log_cat(const CatOptions& options);

}  // namespace mimesis::tool
