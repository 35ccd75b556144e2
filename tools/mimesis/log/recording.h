#pragma once
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "common/log/io.h"
#include "common/runtime/raw.h"

namespace mimesis::tool {

/// A message on its way into a log.
struct Recorded {
  std::string topic, type;
  std::string node;   ///< that published it
  std::string clock;  ///< of that node: wall, sim or lockstep
  std::uint64_t type_hash = 0;
  bool latched = false;
  std::uint64_t start_id = 0;  ///< tells a restarted node from its predecessor
  std::uint64_t seq = 0;
  std::uint64_t lost_before = 0;  ///< missing between the one before and this one
  std::uint64_t log_time_ns = 0, publish_time_ns = 0;
  bool ordered = false;  ///< log_time is a time of the graph: equal ones are sorted by node
  std::string payload;
};

/// Numbers of messages received and lost on one topic of one node.
struct Count {
  std::uint64_t received = 0, lost = 0;
  Count& operator+=(const Count& other);
};

/// By topic and node.
struct Counts {
  std::map<std::pair<std::string, std::string>, Count> topics;
  Count total;

  void add(const Recorded& message);
  void add(const Counts& other);
  /// "TOPIC (NODE)" -> "received=R lost=L", and "total".
  std::map<std::string, std::string> metadata() const;
};

using WallTime = std::chrono::steady_clock::time_point;

/// Takes messages as they arrive: leaves out repeated ones, counts gaps in seq, and hands them on
/// in an order that does not depend on their way here: those of one graph time sorted by node.
class Recording {
 public:
  using WallTime = tool::WallTime;
  using Output = std::function<log::Result(Recorded message, WallTime now)>;

  /// A message is held for so long: until all of its graph time are there to be sorted.
  static constexpr std::chrono::milliseconds kHold{30};

  explicit Recording(Output output) : output_(std::move(output)) {}

  /// Takes a message received at `now`. `from_first`: its publisher started after the recorder, so
  /// that everything before its first message counts as lost.
  [[nodiscard]] log::Result add(Recorded message, WallTime now, bool from_first);
  /// Hands on what was held long enough.
  [[nodiscard]] log::Result advance(WallTime now);
  /// Hands on everything that is held.
  [[nodiscard]] log::Result finish(WallTime now);

  const Counts& counts() const { return counts_; }

 private:
  struct Held {
    Recorded message;
    WallTime received;
  };
  struct Last {
    std::uint64_t start_id, seq;
  };
  std::uint64_t lost_before(const Recorded& message, bool from_first) const;

  Output output_;
  Counts counts_;
  std::map<std::pair<std::string, std::string>, Last> last_;         ///< by topic and node
  std::multimap<std::pair<std::uint64_t, std::string>, Held> held_;  ///< by log time and node
};

/// A tapped message as it goes into a log. Its log time: on a simulated clock the graph's, so that
/// equal runs give equal logs; else its receipt, `now_ns`.
Recorded recorded(runtime::Tapped tapped, std::uint64_t now_ns);

}  // namespace mimesis::tool
