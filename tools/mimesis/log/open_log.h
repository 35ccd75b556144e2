#pragma once
#include <google/protobuf/message_lite.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "common/log/codec.h"
#include "common/log/merged_reader.h"
#include "common/log/summary.h"
#include "tools/mimesis/log/provenance.h"
#include "tools/mimesis/progress.h"
#include "tools/mimesis/topic_filter.h"

// The source of every verb: one or several logs, read as one in the order of log time.
namespace mimesis::tool {

/// Thrown to end a verb: a line for standard error, or none, and the exit code.
struct VerbEnd {
  std::string line;
  int exit_code;
};

/// One file with its contents. A file without a usable summary is read as a whole (its damages are
/// in `summary.damages`).
struct OpenLog {
  std::string path;
  std::unique_ptr<log::Source> source;
  log::Summary summary;
};

/// Opens a file. @throws VerbEnd with exit code 3 if it is not there, 1 if it is no log
OpenLog open_log(const std::string& path);
/// Opens several files as one log: the parts of a split recording, or logs of several hosts.
/// @throws VerbEnd with the first that cannot be opened
std::vector<OpenLog> open_logs(const std::vector<std::string>& paths);

/// Earliest and latest log time of all [ns]; both 0 without a message.
struct Span {
  std::uint64_t start_ns = 0, end_ns = 0;
};
Span span_of(const std::vector<OpenLog>& logs);

// --- Channels and metadata

/// "node" of a channel's metadata: the publisher; empty in foreign logs.
std::string sender_of(const log::Channel& channel);
/// "start_id" of a channel's metadata: which start of that node; empty in older logs.
std::string start_of(const log::Channel& channel);
/// "latched" of a channel's metadata: late joiners get the last message.
bool is_latched(const log::Channel& channel);

/// A channel where it stands.
struct OpenChannel {
  const OpenLog* log;
  const log::Channel* channel;
  const log::Schema* schema;  ///< null: none
  std::string type() const { return schema == nullptr ? "" : schema->name; }
};
std::vector<OpenChannel> channels_of(const std::vector<OpenLog>& logs);
std::vector<OpenChannel> channels_of(const OpenLog& log);
/// Topics of all logs, sorted.
std::vector<std::string> topics_of(const std::vector<OpenLog>& logs);
/// @throws ConfigError with a suggestion
void require_topic(const std::vector<OpenLog>& logs, const std::string& topic);

/// Hands on the metadata records called `name`, or all of them for "". Returns how many could not
/// be read; standard error names them, unless `silent`.
std::uint64_t each_metadata(const std::vector<OpenLog>& logs, const std::string& name,
                            const std::function<void(const log::Metadata&)>& take,
                            bool silent = false);

/// The topics that --topic, --regex and --exclude choose.
struct TopicOptions {
  std::vector<std::string> topics = {};
  std::string regex = {}, exclude = {};
};
/// @throws ConfigError
inline TopicFilter filter_of(const TopicOptions& options) {
  return {options.topics, options.regex, options.exclude};
}

// --- Times

/// Log time that people mean [ns]: "12.5" (seconds from the first message), "1795275600250000000ns"
/// (absolute), "2026-11-21T15:40:00.25Z" or "2026-11-21 15:40:00" (UTC).
/// @throws ConfigError that names `option`.
std::uint64_t parse_log_time(const std::string& option, const std::string& text, const Span& span);

/// A part of a log as the options --start, --end and --duration give it; "" is the whole.
struct TimeRange {
  std::string start = {}, end = {}, duration = {};
  bool whole() const { return start.empty() && end.empty() && duration.empty(); }
};

/// The log times [start, end) of `range`. @throws ConfigError
struct LogTimes {
  std::uint64_t start = 0, end = std::numeric_limits<std::uint64_t>::max();
};
LogTimes resolve(const TimeRange& range, const Span& span);

/// Nanoseconds as seconds, exactly: "12.250000000", "-0.000000001".
std::string seconds_text(std::uint64_t ns, std::uint64_t origin_ns = 0);

// --- Reading

/// All of them in the order of log time; the logs outlive the reader. `offsets_ns`: of each log, or
/// of none.
log::MergedReader merged(const std::vector<OpenLog>& logs, const log::Selection& selection = {},
                         const std::vector<std::int64_t>& offsets_ns = {});

/// A bar for logs that are read by time: bytes are estimated from the share of their time.
class LogProgress {
 public:
  LogProgress(const std::string& what, const std::vector<OpenLog>& logs,
              const log::Selection& selection = {});
  void at(std::uint64_t log_time_ns);

 private:
  Span span_;
  std::uint64_t total_;  ///< unpacked, of the chunks selected [bytes]
  Progress bar_;
};

/// One line per damage on standard error, "FILE: byte N: what"; returns how many there are.
std::uint64_t report_damages(const std::string& path, const std::vector<log::Damage>& damages,
                             std::uint64_t count);
/// The damages of a log, those that a reader `met` included. For a file that was read as a whole,
/// the reader's damages are known already.
std::uint64_t report_damages(const OpenLog& log, const std::vector<log::Damage>& met);
/// The damages that cost messages. A log that only lacks its footer (killed recorder) lost nothing
/// that ever was in the file.
std::uint64_t report_losses(const OpenLog& log, const std::vector<log::Damage>& damages,
                            std::uint64_t count);

using Item = log::MergedReader::Item;

/// False if `data` holds something else.
inline bool parse(std::string_view data, google::protobuf::MessageLite& message) {
  return message.ParseFromArray(data.data(), static_cast<int>(data.size()));
}
inline bool parse(const Item& item, google::protobuf::MessageLite& message) {
  return parse(item.message->data, message);
}

/// For verbs that look: hands every selected message to `take`, with a bar named `what` on a
/// terminal. Returns the number of damages, which are reported on standard error unless `silent` (a
/// second pass need not repeat them).
std::uint64_t scan_logs(const std::vector<OpenLog>& logs, const log::Selection& selection,
                        const std::string& what, const std::function<void(const Item&)>& take,
                        bool silent = false);

/// Most unpacked bytes that a reader in the order of log time holds at once.
std::uint64_t overlap_bytes(const log::Summary& summary);

// --- Sequence numbers and losses

/// Follows the sequence numbers of one publisher on one topic: they count without gaps, modulo
/// 2^32.
class Sequence {
 public:
  struct Step {
    std::uint32_t missing = 0;  ///< between the one before and this one
    bool repeated = false;      ///< the number is that of the message before
    bool back = false;          ///< a lower one
  };
  Step next(std::uint32_t number) {
    const std::uint32_t ahead = number - last_.value_or(number - 1);
    last_ = number;
    if (ahead == 0) return {.repeated = true};
    if (ahead >= 1u << 31) return {.back = true};
    return {.missing = ahead - 1};
  }
  std::optional<std::uint32_t> last() const { return last_; }

 private:
  std::optional<std::uint32_t> last_;
};

/// Every part of a split recording begins with the last values of its latched topics. Finds these
/// repetitions where parts are read as one log.
class LatchedRepeats {
 public:
  /// True if the message before it of this topic, node and start was the same.
  bool repeated(const Item& item) {
    const auto [known, fresh] = channels_.try_emplace(item.channel, nullptr);
    if (fresh && is_latched(*item.channel)) {
      const log::Channel& channel = *item.channel;
      known->second = &last_[{channel.topic, sender_of(channel), start_of(channel)}];
    }
    const log::Message& m = *item.message;
    if (known->second == nullptr || m.sequence == 0) return false;
    const Last now{m.sequence, m.publish_time, log::crc32(0, m.data)};
    return std::exchange(*known->second, now) == now;
  }

 private:
  struct Last {
    std::uint32_t sequence = 0;
    std::uint64_t publish_time = 0;
    std::uint32_t crc = 0;  ///< sum of the payload: nodes restart, numbers repeat
    bool operator==(const Last&) const = default;
  };
  std::map<const log::Channel*, Last*> channels_;
  std::map<std::tuple<std::string, std::string, std::string>, Last> last_;
};

/// Metadata of a recovered log: "TOPIC (NODE)" -> "missing=N" where that is known.
inline constexpr const char* kRecoveredName = "mimesis.recovered";

/// "TOPIC (NODE)".
std::string loss_key(const log::Channel& channel);
/// Adds the counts of a metadata record; other entries are left out.
void add_losses(const std::map<std::string, std::string>& metadata, LossCounts& counts);
/// Counts of all logs; empty if none has counts (killed recorder, foreign log).
std::optional<LossCounts> read_losses(const std::vector<OpenLog>& logs);
}  // namespace mimesis::tool
