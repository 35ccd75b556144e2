#pragma once
#include <memory>
#include <string>
#include <vector>

#include "common/log/merged_reader.h"
#include "common/log/summary.h"

namespace mimesis::tool {

/// A log that cannot be opened: exit code 3 if it is not there, 1 if it is no log.
struct OpenError {
  std::string line;
  int exit_code;
};

/// One file with what it holds. A file without a summary that serves is read as a whole (and
/// `summary.damages` says what that found).
struct OpenLog {
  std::string path;
  std::unique_ptr<log::Source> source;
  log::Summary summary;
};

tl::expected<OpenLog, OpenError> open_log(const std::string& path);

/// Several files as one log: the parts of a split recording, or logs of several hosts. Fails with
/// the first that cannot be opened.
tl::expected<std::vector<OpenLog>, OpenError> open_logs(const std::vector<std::string>& paths);

/// All of them in the order of log time; the logs outlive the reader. `offsets_ns`: of each log, or
/// of none.
log::MergedReader merged(const std::vector<OpenLog>& logs, const log::Selection& selection = {},
                         const std::vector<std::int64_t>& offsets_ns = {});

/// Earliest and latest log time of all [ns]; both 0 without a message.
struct Span {
  std::uint64_t start_ns = 0, end_ns = 0;
};
Span span_of(const std::vector<OpenLog>& logs);

// Metadata of a channel, as our recorder writes it.
/// "node": who published; empty in foreign logs.
std::string sender_of(const log::Channel& channel);
/// "start_id": which start of that node; empty in older logs.
std::string start_of(const log::Channel& channel);
/// "latched": late joiners get the last message.
bool is_latched(const log::Channel& channel);

/// One line per damage on standard error, "FILE: byte N: what"; returns how many there are.
std::uint64_t report_damages(const std::string& path, const std::vector<log::Damage>& damages,
                             std::uint64_t count);

}  // namespace mimesis::tool
