#pragma once
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "tools/mimesis/log/new_log.h"

// The verbs that make a log of others. Each returns the exit code. @throws ConfigError, VerbEnd
namespace mimesis::tool {

struct RewriteOptions {
  std::vector<std::string> inputs;
  OutputOptions output;
  bool json = false;
};

struct FilterOptions : RewriteOptions, TopicOptions {
  std::vector<std::string> nodes;  ///< only what these published; empty: all
  std::string inputs_of;           ///< node: only the messages that its replay needs
  TimeRange range;
  bool latched = true;  ///< last values before the start, at its time
  bool attachments = true, metadata = true;
  std::vector<std::string> notes;         ///< KEY=VALUE, for metadata "mimesis.notes"
  std::vector<std::string> offsets = {};  ///< FILE=SECONDS, added to all times of the file
};
int log_filter(FilterOptions options);

/// A run of sequence numbers of one publisher that is not in the log.
struct MissingRun {
  std::uint32_t first_seq = 0;
  std::uint32_t messages = 0;
  std::uint64_t after_ns = 0, before_ns = 0;  ///< log times of its neighbours
  /// A damaged place of the file lies between the neighbours; false: the recorder had lost them.
  bool damaged = false;
};

struct RecoveredTopic {
  std::string topic, node;
  std::uint64_t messages = 0;
  /// Message count according to the file's own statistics; nothing if these are gone.
  std::optional<std::uint64_t> expected;
  std::vector<MissingRun> missing;
  std::uint64_t last_ns = 0;
  bool placeholder = false;  ///< the definition of the channel is gone

  Sequence sequence;
  std::uint64_t damages_before = 0;  ///< when its last message was read
};

/// Readable and unreadable parts of a log.
struct Recovered {
  std::map<std::uint16_t, RecoveredTopic> topics;  ///< by id of the channel in the input
  std::vector<log::Damage> damages;
  std::uint64_t damage_count = 0;
  bool complete = false;  ///< the input ends as a log does
  bool lost = false;      ///< something that the file held is not in the output
};

/// Copies all that can be read from `in` to `out`, in the order of the file. `summary`: of `in`,
/// has definitions that the data may have lost.
Recovered recover(const log::Source& in, const log::Summary& summary, NewLog& out);
/// Missing parts, one line each: damaged places, then gaps by topic.
std::string recovery_text(const std::string& input, const Recovered& recovered);
/// Exit code 0: the output holds all that was in the file; 1: something is missing.
int log_recover(const RewriteOptions& options);

}  // namespace mimesis::tool
