#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "common/log/writer.h"

namespace mimesis::tool {

/// A message on its way into a log.
struct Recorded {
  std::string topic, type;
  std::string node;  ///< that published it
  std::uint64_t type_hash = 0;
  bool latched = false;
  std::uint64_t start_id = 0;  ///< tells a restarted node from its predecessor
  std::uint64_t seq = 0;
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  bool ordered = false;  ///< log_time is a time of the graph: equal ones are sorted by node
  std::string payload;
};

/// What was received and what is missing on one topic of one node.
struct TopicCount {
  std::uint64_t received = 0, lost = 0;
  std::uint64_t start_id = 0, last_seq = 0;
};

/// Turns messages into a log: a channel per topic and node, gaps in seq counted, messages of one
/// graph time sorted by node whatever their way here, chunks closed after a time.
class Recording {
 public:
  using WallTime = std::chrono::steady_clock::time_point;

  /// Held for `hold` so that all messages of a graph time are there to be sorted, then at most
  /// `chunk_period` in memory: whoever kills the recorder loses the sum.
  static constexpr std::chrono::milliseconds kHold{30}, kChunkPeriod{40};

  /// `descriptors(type)`: serialised FileDescriptorSet. `writer` outlives the recording.
  Recording(log::Writer& writer, std::function<std::string(const std::string& type)> descriptors);

  /// Takes a message received at `now`. `missed_before`: the first of its publisher counts all
  /// before it as lost.
  [[nodiscard]] log::Result add(Recorded message, WallTime now, bool from_first);
  /// Writes what was held long enough, closes a chunk that was open long enough.
  [[nodiscard]] log::Result advance(WallTime now);
  /// Writes everything that is held, and the counts as metadata "mimesis.counts".
  [[nodiscard]] log::Result finish();

  /// By topic and node.
  const std::map<std::pair<std::string, std::string>, TopicCount>& counts() const {
    return counts_;
  }
  std::uint64_t received() const { return received_; }
  std::uint64_t lost() const { return lost_; }

 private:
  struct Held {
    Recorded message;
    WallTime received;
  };
  log::Result write(const Recorded& message, WallTime now);
  tl::expected<std::uint16_t, Status> channel(const Recorded& message);

  log::Writer& writer_;
  std::function<std::string(const std::string&)> descriptors_;
  std::map<std::string, std::uint16_t> schemas_;  ///< by type
  std::map<std::tuple<std::string, std::string, std::string>, std::uint16_t>
      channels_;  ///< topic, node, type
  std::map<std::pair<std::string, std::string>, TopicCount> counts_;
  std::multimap<std::pair<std::uint64_t, std::string>, Held> held_;  ///< by log time and node
  WallTime chunk_opened_{};
  std::uint64_t received_ = 0, lost_ = 0;
};

}  // namespace mimesis::tool
