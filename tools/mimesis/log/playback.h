#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <functional>
#include <limits>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <unordered_map>
#include <utility>
#include <vector>

#include "common/error.h"
#include "common/runtime/own_topics.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/log/field_columns.h"
#include "tools/mimesis/log/open_log.h"
#include "tools/mimesis/topic_filter.h"

// The messages of a log as a player takes them: selected, renamed, in their order, read ahead.
namespace mimesis::tool {

/// New names for topics. OLD:=NEW renames one topic, OLD/:=NEW/ all below a prefix ("/" alone: the
/// root). A whole name goes before a prefix, a longer prefix before a shorter one.
class PlayRemap {
 public:
  PlayRemap() = default;
  /// @throws ConfigError unless every rule has one of the two forms and no OLD comes twice.
  explicit PlayRemap(const std::vector<std::string>& rules) {
    for (const std::string& text : rules) {
      const std::size_t at = text.find(":=");
      const std::string from = text.substr(0, at);
      const std::string to = at == std::string::npos ? "" : text.substr(at + 2);
      if (from.empty() || to.empty() || from.ends_with('/') != to.ends_with('/')) {
        throw ConfigError("--remap '" + text + "': expected OLD:=NEW, or OLD/:=NEW/ for a prefix");
      }
      for (const Rule& other : rules_) {
        if (other.text.substr(0, other.text.find(":=")) != from) continue;
        throw ConfigError("--remap '" + text + "': '" + other.text + "' says otherwise");
      }
      rules_.push_back({text, from == "/" ? "" : from, to == "/" ? "" : to, from.ends_with('/')});
    }
  }

  std::string operator()(const std::string& topic) const {
    const Rule* rule = rule_for(topic);
    return rule == nullptr ? topic : rule->to + topic.substr(rule->from.size());
  }
  /// The rules that match none of these topics: probably misspelt.
  std::vector<std::string> unused(const std::vector<std::string>& topics) const {
    std::set<const Rule*> used;
    for (const std::string& topic : topics) used.insert(rule_for(topic));
    std::vector<std::string> rest;
    for (const Rule& rule : rules_) {
      if (!used.contains(&rule)) rest.push_back(rule.text);
    }
    return rest;
  }

 private:
  struct Rule {
    std::string text, from, to;  ///< parts of a prefix: with the slash; "" is the root
    bool prefix = false;
  };
  const Rule* rule_for(const std::string& topic) const {
    const Rule* best = nullptr;
    for (const Rule& rule : rules_) {
      if (!rule.prefix && topic == rule.from) return &rule;
      if (!rule.prefix || !topic.starts_with(rule.from)) continue;
      if (best == nullptr || best->from.size() < rule.from.size()) best = &rule;
    }
    return best;
  }

  std::vector<Rule> rules_;
};

/// Selects the part of a log that is played, and the names. Positions: seconds of log time from the
/// first message of the log.
struct PlaybackOptions {
  TopicFilter filter{{}, "", ""};  ///< filter of recorded names
  PlayRemap remap{};
  /// Plays also the messages of recorded nodes about themselves (NODE/start, steps, health, log).
  /// Those that the filter names are played anyway.
  bool about_nodes = false;
  /// A seek gives the last message before of every topic, not of latched ones alone: for viewers.
  bool last_of_all = false;
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
  std::string payload;
};

/// The messages of a log (several files: the parts of one) in the order of their log times, equal
/// ones in the order of the files. A seek gives for each latched topic (`last_of_all`: for each)
/// the last value before, so that a late start shows what a late subscriber would get. The values
/// that a recorder repeats at the head of every part are left out.
class Playback {
 public:
  /// @throws ConfigError if nothing is selected, a topic has two types, or nothing lies in the
  /// time.
  Playback(std::vector<OpenLog> logs, const PlaybackOptions& options)
      : logs_(std::move(logs)), span_(span_of(logs_)), last_of_all_(options.last_of_all) {
    find_topics(options);
    const LogTimes times = resolve(options.range, span_);
    start_ns_ = std::max(times.start, span_.start_ns);
    end_ns_ = std::min(times.end, span_.end_ns);
    if (start_ns_ <= end_ns_) return;
    throw ConfigError(fmt::format("{}: nothing of its {:.3f} s lies between {:.3f} s and {:.3f} s",
                                  name(), position_s(span_.end_ns), position_s(start_ns_),
                                  position_s(end_ns_)));
  }
  Playback(const Playback&) = delete;
  Playback& operator=(const Playback&) = delete;

  const std::vector<OpenLog>& logs() const { return logs_; }
  const std::deque<PlayedTopic>& topics() const { return topics_; }
  /// Lines about requested topics that are not played: no such topic, or not Protobuf.
  const std::vector<std::string>& notes() const { return notes_; }
  std::uint64_t start_ns() const { return start_ns_; }  ///< log times [start_ns, end_ns]
  std::uint64_t end_ns() const { return end_ns_; }      ///< are played
  double position_s(std::uint64_t log_time_ns) const {
    return log_time_ns < span_.start_ns ? -static_cast<double>(span_.start_ns - log_time_ns) / 1e9
                                        : static_cast<double>(log_time_ns - span_.start_ns) / 1e9;
  }
  std::uint64_t log_time_ns(double position_s) const {
    constexpr double kLongest_s = 1e10;  // 317 years: in 64 bits of nanoseconds
    const auto ns = static_cast<std::uint64_t>(std::clamp(position_s, 0.0, kLongest_s) * 1e9);
    return std::min(ns, kLast - span_.start_ns) + span_.start_ns;
  }

  /// `next` continues with the first message at or after this time, not before start_ns. The last
  /// values before it, in their order. Reads only chunks that hold such.
  std::vector<Played> seek(std::uint64_t log_time_ns) {
    constexpr std::uint64_t kFirstLook = 1'000'000'000;  // back [ns]; then four times as far
    const std::uint64_t target = std::max(log_time_ns, start_ns_);
    std::set<const PlayedTopic*> missing;
    for (const PlayedTopic& topic : topics_) {
      if (topic.latched || last_of_all_) missing.insert(&topic);
    }
    repeats_ = {};
    std::vector<Played> values;
    std::uint64_t look = kFirstLook;
    for (std::uint64_t to = target; !missing.empty() && to > span_.start_ns; look *= 4) {
      const std::uint64_t from = to - std::min(look, to - span_.start_ns);
      const auto wanted = [&](const log::Channel& channel) {
        const auto it = topic_of_.find(&channel);
        return it != topic_of_.end() && (last_of_all_ || is_latched(channel)) &&
               missing.contains(it->second);
      };
      select({wanted, from, to});
      std::vector<Played> earlier;
      for (Played value; next(value);) {
        std::erase_if(earlier, [&](const Played& other) { return other.topic == value.topic; });
        earlier.push_back(value);
      }
      for (const Played& value : earlier) missing.erase(value.topic);
      values.insert(values.begin(), earlier.begin(), earlier.end());
      to = from;
    }
    const auto played = [this](const log::Channel& channel) {
      return topic_of_.contains(&channel);
    };
    select({played, target, std::max(end_ns_, end_ns_ + 1)});
    return values;
  }
  /// Next message; false at the end. Precondition: `seek` was called.
  bool next(Played& out) {
    while (const Item* item = reader_->next()) {
      if (repeats_.repeated(*item)) continue;
      const log::Message& m = *item->message;
      out.topic = topic_of_.at(item->channel);
      out.log_time_ns = m.log_time;
      out.publish_time_ns = m.publish_time;
      const auto ros = ros_.find(item->channel);
      if (ros == ros_.end()) {
        out.payload.assign(m.data);
      } else if (ros->second->read(m.data).empty()) {
        out.payload = ros->second->message().SerializeAsString();
      } else {
        continue;  // `log check` names it
      }
      return true;
    }
    return false;
  }

  /// Reads other messages beside those that are played; for any thread.
  std::unique_ptr<log::MergedReader> reader(const log::Selection& selection) const {
    return std::make_unique<log::MergedReader>(merged(logs_, selection));
  }

  /// Prints lines on standard error for parts that could not be read so far; returns their number.
  std::uint64_t report_damages() {
    keep_damages();
    std::uint64_t total = 0;
    for (const OpenLog& log : logs_) total += tool::report_damages(log, {});
    return total;
  }

 private:
  static constexpr std::uint64_t kLast = std::numeric_limits<std::uint64_t>::max();

  std::string name() const {
    return logs_.size() == 1 ? logs_[0].path
                             : fmt::format("{} and {} more", logs_[0].path, logs_.size() - 1);
  }
  void find_topics(const PlaybackOptions& options) {
    std::set<std::string> foreign;
    const std::vector<std::string>& named = options.filter.topics();
    for (const OpenChannel& c : channels_of(logs_)) {
      const std::string& topic = c.channel->topic;
      // The time of the recorded run is not the time of this one.
      if (c.type() == "mimesis.v1.ClockTime" || !options.filter(topic)) continue;
      // Published by the runtime. Foreign topics with such names are played.
      const bool about_a_node = runtime::is_own_topic(topic) &&
                                (c.type().starts_with("mimesis.v1.") || c.type() == "foxglove.Log");
      if (c.schema != nullptr && cdr::RosType::reads(c.schema->encoding) &&
          c.channel->message_encoding == "cdr") {
        add_ros(c, options.remap(topic.starts_with('/') ? topic.substr(1) : topic));
      } else if (c.schema == nullptr || c.schema->encoding != "protobuf") {
        foreign.insert(topic);
      } else if (options.about_nodes || !about_a_node ||
                 std::ranges::find(named, topic) != named.end()) {
        add(c, options.remap(topic), c.type(), c.schema->data);
      }
    }
    if (topics_.empty()) {
      throw ConfigError(fmt::format("{}: none of its topics is selected", name()));
    }
    const std::vector<std::string> recorded = topics_of(logs_);
    if (const auto unused = options.remap.unused(recorded); !unused.empty()) {
      throw ConfigError(fmt::format("--remap '{}': {} has no such topic", unused[0], name()));
    }
    for (const std::string& topic : named) {
      if (std::ranges::binary_search(recorded, topic)) continue;
      notes_.push_back(fmt::format("{}: no topic {}", name(), topic));
    }
    for (const std::string& topic : foreign) {
      notes_.push_back(fmt::format("{}: topic {} is not Protobuf and not played", name(), topic));
    }
  }
  /// A topic of ROS 2 is played as Protobuf of the same fields.
  void add_ros(const OpenChannel& c, const std::string& topic) {
    try {
      auto type = std::make_unique<LogType>(*c.schema, types_);
      const auto& descriptor = *type->message().GetDescriptor();
      add(c, topic, descriptor.full_name(), runtime::descriptor_set(descriptor));
      ros_[c.channel] = std::move(type);
    } catch (const ConfigError& e) {
      notes_.push_back(fmt::format("{}: topic {} ({}) is not played: {}", name(), c.channel->topic,
                                   c.type(), e.what()));
    }
  }
  void add(const OpenChannel& c, const std::string& topic, const std::string& type,
           const std::string& descriptors) {
    auto same = std::ranges::find(topics_, topic, &PlayedTopic::topic);
    if (same == topics_.end()) {
      topics_.push_back({topic, type, descriptors, false});
      same = topics_.end() - 1;
    } else if (same->type != type) {
      throw ConfigError(
          fmt::format("topic {} has two types in {}: {} and {}; --exclude one or --remap it", topic,
                      name(), same->type, type));
    }
    same->latched = same->latched || is_latched(*c.channel);
    topic_of_[c.channel] = &*same;
  }
  /// Reads these from now on.
  void select(const log::Selection& selection) {
    keep_damages();
    reader_ = reader(selection);
  }
  /// Damage that the reader met becomes that of its log, once.
  void keep_damages() {
    for (std::size_t i = 0; i < logs_.size() && reader_; ++i) {
      log::Summary& summary = logs_[i].summary;
      for (const log::Damage& met : reader_->damages(i)) {
        const auto at =
            std::ranges::lower_bound(summary.damages, met.offset, {}, &log::Damage::offset);
        if (at != summary.damages.end() && at->offset == met.offset) continue;
        summary.damages.insert(at, met);
        ++summary.damage_count;
      }
    }
  }

  std::vector<OpenLog> logs_;
  Span span_;
  const bool last_of_all_;
  std::deque<PlayedTopic> topics_;
  std::vector<std::string> notes_;
  std::unordered_map<const log::Channel*, const PlayedTopic*> topic_of_;
  runtime::TypePool types_;
  std::unordered_map<const log::Channel*, std::unique_ptr<LogType>> ros_;
  std::uint64_t start_ns_ = 0, end_ns_ = 0;
  std::unique_ptr<log::MergedReader> reader_;
  LatchedRepeats repeats_;
};

/// So much is read before it is due; the first bound that is reached counts.
struct PlayAheadLimits {
  /// Log time read ahead; 0: half a second, twice as much whenever it was too little.
  double seconds = 0.0;
  std::size_t bytes = std::size_t{128} << 20U;
};

/// Reads and unpacks a playback on a thread of its own, so that neither the disk nor a large chunk
/// makes messages late.
class PlayAhead {
 public:
  /// `arrived` is called on the thread when messages are there after `front` had none, and at the
  /// end. The playback is this object's until it is gone.
  PlayAhead(Playback& playback, PlayAheadLimits limits, std::function<void()> arrived)
      : playback_(playback),
        limits_(limits),
        arrived_(std::move(arrived)),
        seconds_(limits.seconds > 0.0 ? limits.seconds : kFirstSeconds) {}

  /// Like Playback::seek.
  std::vector<Played> seek(std::uint64_t log_time_ns) {
    stop();
    queue_.clear();
    bytes_ = 0;
    at_end_ = primed_ = full_ = false;
    std::vector<Played> latched = playback_.seek(log_time_ns);
    thread_ = std::jthread([this](const std::stop_token& stop) { read(stop); });
    return latched;
  }
  /// Next message, valid until `pop`; null if there is none now, or none at all (`ended`).
  const Played* front() {
    const std::lock_guard lock(mutex_);
    if (!queue_.empty()) {
      primed_ = true;
      return &queue_.front();
    }
    if (at_end_) return nullptr;
    if (primed_ && !awaited_ && limits_.seconds <= 0.0) {
      seconds_ = std::min(2.0 * seconds_, kMostSeconds);
    }
    awaited_ = true;
    return nullptr;
  }
  void pop() {
    const std::lock_guard lock(mutex_);
    bytes_ -= queue_.front().payload.size();
    spare_.push_back(std::move(queue_.front().payload));
    queue_.pop_front();
    if (full_ && !enough(kRefill)) taken_.notify_one();
  }
  bool ended() {  ///< all was delivered
    const std::lock_guard lock(mutex_);
    return at_end_ && queue_.empty();
  }
  bool full() {  ///< reads no further before something is taken
    const std::lock_guard lock(mutex_);
    return full_;
  }
  /// Seconds of log time per second: what `seconds` of the limits is worth.
  void set_rate(double rate) {
    const std::lock_guard lock(mutex_);
    rate_ = rate;
    taken_.notify_one();
  }
  void stop() { thread_ = {}; }  ///< the playback may be used again

 private:
  static constexpr double kFirstSeconds = 0.5, kMostSeconds = 8.0;
  static constexpr double kRefill = 0.75;  ///< reads on when at most this share is left
  static constexpr std::size_t kWorthBytes = 256 * 1024, kWorthMessages = 1024;  ///< to `arrive`

  void read(const std::stop_token& stop) {
    Played next;
    for (bool more = true; more && !stop.stop_requested();) {
      more = playback_.next(next);
      std::unique_lock lock(mutex_);
      if (more) {
        bytes_ += next.payload.size();
        queue_.push_back(std::exchange(next, {}));
      }
      if (!spare_.empty()) {  // fresh memory costs more than a copy
        next.payload = std::move(spare_.back());
        spare_.pop_back();
      }
      at_end_ = !more;
      full_ = at_end_ || enough(1.0);
      const bool worth = bytes_ >= kWorthBytes || queue_.size() >= kWorthMessages;
      if (full_ || (awaited_ && worth)) {
        awaited_ = false;
        arrived_();
      }
      if (!full_ || at_end_) continue;
      taken_.wait(lock, stop, [this] { return !enough(kRefill); });
      full_ = false;
    }
  }
  /// This share of a limit is there; with the lock.
  bool enough(double share) const {
    if (queue_.empty()) return false;
    if (static_cast<double>(bytes_) >= share * static_cast<double>(limits_.bytes)) return true;
    const std::uint64_t ahead_ns = queue_.back().log_time_ns - queue_.front().log_time_ns;
    return static_cast<double>(ahead_ns) * 1e-9 >= share * seconds_ * rate_;
  }

  Playback& playback_;
  PlayAheadLimits limits_;
  std::function<void()> arrived_;

  std::mutex mutex_;
  std::condition_variable_any taken_;
  std::deque<Played> queue_;
  std::vector<std::string> spare_;  ///< memory for payloads: as many as were ever ahead at once
  std::size_t bytes_ = 0;           ///< in queue_
  double seconds_, rate_ = 1.0;
  bool at_end_ = false, awaited_ = false, full_ = false;
  bool primed_ = false;  ///< something was delivered since the seek
  std::jthread thread_;
};

}  // namespace mimesis::tool
