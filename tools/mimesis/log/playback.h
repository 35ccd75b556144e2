#pragma once
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <unordered_map>
#include <vector>

#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/topic_filter.h"

namespace mimesis::tool {

/// New names for topics. OLD:=NEW renames one topic, OLD/:=NEW/ all below a prefix ("/" alone: the
/// root). A whole name goes before a prefix, a longer prefix before a shorter one.
class PlayRemap {
 public:
  PlayRemap() = default;
  /// @throws ConfigError unless every rule has one of the two forms and no OLD comes twice.
  explicit PlayRemap(const std::vector<std::string>& rules);

  std::string operator()(const std::string& topic) const;
  /// The rules that concern none of these topics: spelt wrong, most likely.
  std::vector<std::string> unused(const std::vector<std::string>& topics) const;

 private:
  struct Rule {
    std::string text, from, to;  ///< of a prefix: with the slash; "" is the root
    bool prefix = false;
  };
  const Rule* rule_for(const std::string& topic) const;

  std::vector<Rule> rules_;
};

/// Selects the part of a log that is played, and the names. Positions: seconds of log time from the
/// first message of the log.
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

/// A message that owns its payload.
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

/// So much is read before it is due; the first bound that is reached counts.
struct PlayAheadLimits {
  double seconds =
      0.0;  ///< of log time; 0: half a second, twice as much whenever it was too little
  std::size_t bytes = std::size_t{128} << 20U;
};

/// Reads and unpacks a playback on a thread of its own, so that neither the disk nor a large chunk
/// makes messages late.
class PlayAhead {
 public:
  /// `arrived` is called on the thread when messages are there after `front` had none, and at the
  /// end. The playback is this object's until it is gone.
  PlayAhead(Playback& playback, PlayAheadLimits limits, std::function<void()> arrived);
  ~PlayAhead();

  /// As Playback::seek.
  std::vector<PlayedValue> seek(std::uint64_t log_time_ns);
  /// Next message, valid until `pop`; null if there is none now, or none at all (`ended`).
  const Played* front();
  void pop();
  bool ended();  ///< all was delivered
  bool full();   ///< reads no further before something is taken
  /// Seconds of log time per second: what `seconds` of the limits is worth.
  void set_rate(double rate);
  void stop();  ///< the playback may be used again

 private:
  struct Batch {
    std::vector<char> bytes;
    std::vector<Played> messages;
    std::vector<std::size_t> ends;  ///< of the payloads in `bytes`
  };
  void read(const std::stop_token& stop);
  bool fill(Batch& batch);
  bool enough() const;  ///< with the lock

  Playback& playback_;
  PlayAheadLimits limits_;
  std::function<void()> arrived_;

  std::mutex mutex_;
  std::condition_variable_any taken_;
  std::deque<Batch> batches_, spare_;
  std::size_t bytes_ = 0;  ///< in batches_
  double seconds_, rate_ = 1.0;
  bool at_end_ = false, awaited_ = false, full_ = false;

  Batch current_;  ///< being delivered
  std::size_t next_ = 0;
  bool primed_ = false;  ///< something was delivered since the seek
  std::jthread thread_;
};

}  // namespace mimesis::tool
