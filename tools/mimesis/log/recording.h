#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <utility>

#include "common/log/io.h"
#include "common/runtime/raw.h"

namespace mimesis::tool {

/// Why a recording cannot be written on. Ends the recording, not the program: its other files are
/// to be closed well.
class WriteFailure : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};
/// The result of writing. @throws WriteFailure
template <class T>
T written(tl::expected<T, Status> result) {
  if (!result) throw WriteFailure(result.error().reason);
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

/// A message on its way into a log.
struct Recorded {
  std::string topic, type;
  std::string node;   ///< node that published it
  std::string clock;  ///< clock of that node: wall, sim or lockstep
  std::uint64_t type_hash = 0;
  bool latched = false;
  std::uint64_t start_id = 0;  ///< distinguishes a restarted node from its predecessor
  std::uint64_t seq = 0;
  std::uint64_t lost_before = 0;  ///< missing between the one before and this one
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  bool ordered = false;  ///< log_time is a time of the graph: equal ones are sorted by node
  std::string payload;
};

using TopicAndNode = std::pair<std::string, std::string>;

/// Numbers of messages received and lost.
struct Counts {
  struct Count {
    std::uint64_t received = 0, lost = 0;
    std::string text() const {
      return "received=" + std::to_string(received) + " lost=" + std::to_string(lost);
    }
  };
  std::map<TopicAndNode, Count> topics;
  Count total;

  void add(const TopicAndNode& key, const Count& more) {
    for (Count* count : {&topics[key], &total}) {
      count->received += more.received;
      count->lost += more.lost;
    }
  }
  void add(const Recorded& m) { add({m.topic, m.node}, {1, m.lost_before}); }
  /// "TOPIC (NODE)" -> "received=R lost=L", and "total".
  std::map<std::string, std::string> metadata() const {
    std::map<std::string, std::string> lines{{"total", total.text()}};
    for (const auto& [key, count] : topics) {
      lines[key.first + " (" + key.second + ")"] = count.text();
    }
    return lines;
  }
};

using WallTime = std::chrono::steady_clock::time_point;

/// Takes messages as they arrive: leaves out repeated ones, counts gaps in seq, and hands them on
/// in an order that does not depend on their way here: those of one graph time sorted by node.
class Recording {
 public:
  using Output = std::function<void(Recorded message, WallTime now)>;

  /// Time that messages are held, until all of that graph time have arrived to be sorted.
  static constexpr std::chrono::milliseconds kHold{30};

  explicit Recording(Output output) : output_(std::move(output)) {}

  /// Takes a message received at `now`. `from_first`: its publisher started after the recorder, so
  /// that everything before its first message counts as lost.
  void add(Recorded message, WallTime now, bool from_first) {
    const auto [last, is_first] = last_.try_emplace({message.topic, message.node});
    const bool goes_on = !is_first && last->second.start_id == message.start_id;
    if (goes_on && message.seq <= last->second.seq) return;  // a latched message, repeated
    if (goes_on || from_first) {
      message.lost_before = message.seq - (goes_on ? last->second.seq : 0) - 1;
    }
    last->second = {message.start_id, message.seq};
    counts_.add(message);
    if (!message.ordered) return output_(std::move(message), now);
    std::pair key{message.log_time_ns, message.node};
    held_.emplace(std::move(key), Held{std::move(message), now});
  }
  /// Passes on messages that were held long enough.
  void advance(WallTime now) {
    // The first one held is the earliest of the graph, not the first to have come: it alone
    // decides.
    while (!held_.empty() && held_.begin()->second.received + kHold <= now) release(now);
  }
  /// Hands on everything that is held.
  void finish(WallTime now) {
    while (!held_.empty()) release(now);
  }

  const Counts& counts() const { return counts_; }

 private:
  struct Held {
    Recorded message;
    WallTime received;
  };
  struct Last {
    std::uint64_t start_id = 0, seq = 0;
  };
  void release(WallTime now) {
    output_(std::move(held_.extract(held_.begin()).mapped().message), now);
  }

  Output output_;
  Counts counts_;
  std::map<TopicAndNode, Last> last_;
  std::multimap<std::pair<std::uint64_t, std::string>, Held> held_;  ///< by log time and node
};

}  // namespace mimesis::tool
