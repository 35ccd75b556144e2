#pragma once
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "common/log/indexed_reader.h"

namespace mimesis::tool {

/// What of a log is played.
struct PlaybackOptions {
  std::function<bool(const std::string& topic)> topic;  ///< null: all
  double start_s = 0.0;      ///< from the first message of the log [s of log time]
  double duration_s = -1.0;  ///< negative: to the end [s of log time]
};

/// One topic to be published.
struct PlayedTopic {
  std::string topic, type, descriptors;  ///< descriptors: serialised FileDescriptorSet
  bool latched = false;
  std::uint64_t messages = 0;
};

/// A message at its time.
struct Played {
  const PlayedTopic* topic = nullptr;
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  std::string_view payload;  ///< until the next call
};

/// The messages of a log in the order of their log times. Before the first one, latched topics give
/// the last value they had before the start, so that a player that starts late shows what a late
/// subscriber would see.
class Playback {
 public:
  /// @throws ConfigError if the file is no log, or nothing in it is selected, or a topic has two
  /// types.
  Playback(const std::string& path, PlaybackOptions options);

  const std::vector<PlayedTopic>& topics() const { return topics_; }
  std::uint64_t start_time_ns() const { return start_ns_; }  ///< log time at which playing starts
  std::uint64_t end_time_ns() const { return end_ns_; }      ///< of the last message at most
  /// Last values of latched topics before the start, in their order.
  const std::vector<std::pair<const PlayedTopic*, std::string>>& latched() const {
    return latched_;
  }

  /// Next message, or false at the end.
  bool next(Played& out);
  void rewind();
  /// Chunks left out, of the file and of this pass.
  std::vector<log::Damage> damages() const;

 private:
  void find_topics(const PlaybackOptions& options);
  void find_latched();
  log::Selection selection(std::uint64_t from, std::uint64_t to, bool only_latched) const;

  std::unique_ptr<log::Source> source_;
  log::Summary summary_;
  std::vector<PlayedTopic> topics_;
  std::map<std::uint16_t, std::size_t> by_channel_;  ///< index in topics_
  std::vector<std::pair<const PlayedTopic*, std::string>> latched_;
  std::uint64_t start_ns_ = 0, end_ns_ = 0;
  std::unique_ptr<log::IndexedReader> reader_;
};

}  // namespace mimesis::tool
