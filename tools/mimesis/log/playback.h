#pragma once
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <unordered_map>
#include <vector>

#include "tools/mimesis/log/log_time.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/log/play_remap.h"
#include "tools/mimesis/topic_filter.h"

namespace mimesis::tool {

/// What of a log is played, and under which names. Positions: seconds of log time from the first
/// message of the log.
struct PlaybackOptions {
  TopicFilter filter{{}, "", ""};  ///< of recorded names
  PlayRemap remap{};
  /// Also what recorded nodes said about themselves (NODE/start, steps, health, log). Those that
  /// the filter has by name are played anyway.
  bool about_nodes = false;
  TimeRange range{};  ///< its end is played, too
};

/// One topic to be published.
struct PlayedTopic {
  std::string topic;              ///< after the remap
  std::string type, descriptors;  ///< descriptors: serialised FileDescriptorSet
  bool latched = false;
};

/// A message at its time.
struct Played {
  const PlayedTopic* topic = nullptr;
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  std::string_view payload;  ///< not owned
};

/// The same with its payload.
struct PlayedValue {
  const PlayedTopic* topic = nullptr;
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  std::string payload;
};

/// The messages of a log (several files: the parts of one) in the order of their log times, equal
/// ones in the order of the files. A seek gives for each latched topic the last value before, so
/// that who starts late shows what a late subscriber would see. The values that a recorder repeats
/// at the head of every part are left out.
class Playback {
 public:
  /// @throws ConfigError if nothing is selected, a topic has two types, or nothing lies in the
  /// time.
  Playback(std::vector<OpenLog> logs, const PlaybackOptions& options);
  Playback(const Playback&) = delete;
  Playback& operator=(const Playback&) = delete;

  const std::vector<PlayedTopic>& topics() const { return topics_; }
  /// Lines about what was asked for and is not played: no such topic, or not Protobuf.
  const std::vector<std::string>& notes() const { return notes_; }
  std::uint64_t log_start_ns() const { return span_.start_ns; }  ///< log time of position 0
  std::uint64_t start_ns() const { return start_ns_; }           ///< log times [start_ns, end_ns]
  std::uint64_t end_ns() const { return end_ns_; }               ///< are played
  double position_s(std::uint64_t log_time_ns) const;
  std::uint64_t log_time_ns(double position_s) const;

  /// `next` goes on with the first message at or after this time, not before start_ns. The last
  /// values of latched topics before it, in their order. Reads only chunks that hold such.
  std::vector<PlayedValue> seek(std::uint64_t log_time_ns);
  /// Next message, valid until the next call; false at the end. Precondition: `seek` was called.
  bool next(Played& out);

  /// Lines on standard error for what could not be read so far; their number.
  std::uint64_t report_damages();

 private:
  struct Origin {
    std::size_t topic = 0, publisher = 0;  ///< indexes
    bool latched = false;
    bool told_apart = false;  ///< a restarted publisher has another index
  };
  struct Last {
    std::uint32_t sequence = 0;  ///< 0: none yet
    std::size_t hash = 0;        ///< of the payload
  };
  void find_topics(const PlaybackOptions& options);
  void add(const log::Channel& channel, const log::Schema& schema, const PlaybackOptions& options);
  void find_range(const TimeRange& range);
  bool repeated(const Origin& origin, const log::Message& message);
  std::vector<PlayedValue> last_values(const std::set<std::size_t>& topics, std::uint64_t from_ns,
                                       std::uint64_t to_ns);
  void keep_damages(const log::MergedReader& reader);
  std::string name() const;

  std::vector<OpenLog> logs_;
  Span span_;
  std::vector<PlayedTopic> topics_;
  std::vector<std::string> notes_;
  std::unordered_map<const log::Channel*, Origin> origins_;
  std::map<std::string, std::size_t> publishers_;  ///< by topic, node and start id
  std::vector<Last> last_;                         ///< by publisher
  std::uint64_t start_ns_ = 0, end_ns_ = 0;
  std::unique_ptr<log::MergedReader> reader_;
  std::map<std::pair<std::size_t, std::uint64_t>, std::string> damages_;  ///< by log and offset
};

}  // namespace mimesis::tool
