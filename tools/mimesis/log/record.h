#pragma once
#include <string>
#include <vector>

#include "common/log/codec.h"
#include "tools/mimesis/topic_filter.h"

namespace mimesis::tool {

struct RecordOptions {
  TopicFilter filter;
  std::string output;
  log::Compression compression = log::Compression::zstd;
  double duration_s = 0.0;          ///< of wall time; 0: until stopped
  std::vector<std::string> attach;  ///< files that are stored in the log
  bool json = false;
};

/// `mimesis log record`: records the graph until SIGINT, SIGTERM or SIGHUP. Returns the exit code:
/// 0 if nothing was lost, else 1. @throws ConfigError before the first message.
int log_record(const RecordOptions& options);

}  // namespace mimesis::tool
