#pragma once
#include <chrono>
#include <string>
#include <vector>

#include "common/log/codec.h"
#include "tools/mimesis/log/disk_limits.h"
#include "tools/mimesis/log/snapshot.h"
#include "tools/mimesis/log/split.h"
#include "tools/mimesis/topic_filter.h"

namespace mimesis::tool {

struct RecordOptions {
  TopicFilter filter;
  std::string output;
  log::Compression compression = log::Compression::zstd;
  double duration_s = 0.0;               ///< of wall time; 0: until stopped
  std::vector<std::string> attach = {};  ///< files that are stored in the log
  SplitOptions split = {};               ///< not together with snapshots
  SnapshotOptions snapshot = {};
  DiskLimits limits = {};
  std::chrono::nanoseconds sync{0};       ///< period of fsync; 0: never
  std::vector<std::string> command = {};  ///< line that was called, for the log
  bool quiet = false;                     ///< no live counts
  bool json = false;
};

/// `mimesis log record`: records the graph until SIGINT, SIGTERM or SIGHUP. Returns the exit code:
/// 0 if something was recorded and nothing was lost, else 1. @throws ConfigError before the first
/// message.
int log_record(const RecordOptions& options);

}  // namespace mimesis::tool
