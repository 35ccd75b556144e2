#pragma once
#include <google/protobuf/message.h>

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/runtime/raw.h"
#include "tools/mimesis/log/log_time.h"
#include "tools/mimesis/log/open_log.h"

namespace mimesis::tool {

/// What of some logs is read.
struct ScanOptions {
  std::function<bool(const log::Channel&)> channel = {};  ///< null: all
  LogTimes times = {};
  bool silent = false;  ///< a second pass, which need not say the same again
};

/// Calls `take` for every message in the order of log time, with a bar named `what` on a terminal.
/// Says on standard error what could not be read; returns how many such places there are.
std::uint64_t scan_logs(const std::vector<OpenLog>& logs, const ScanOptions& options,
                        const std::string& what,
                        const std::function<void(const log::MergedReader::Item&)>& take);

/// Topics of all logs, sorted.
std::vector<std::string> topics_of(const std::vector<OpenLog>& logs);

/// Nanoseconds as seconds, exactly: "12.250000000", "-0.000000001".
std::string seconds_text(std::uint64_t ns, std::uint64_t origin_ns = 0);

/// Messages by the descriptor sets of their logs.
class LogDecoder {
 public:
  /// Null if the message is not Protobuf, or not a valid one. Lives until the next of its type.
  const google::protobuf::Message* decode(const log::MergedReader::Item& item);
  /// An empty one; null as above.
  google::protobuf::Message* type(const log::Schema* schema);
  /// An empty one of a channel. @throws ConfigError if that has no Protobuf with a schema.
  const google::protobuf::Message& type(const OpenLog& log, const log::Channel& channel);

 private:
  runtime::TypePool types_;
  std::map<const log::Schema*, std::unique_ptr<google::protobuf::Message>> messages_;
};

}  // namespace mimesis::tool
