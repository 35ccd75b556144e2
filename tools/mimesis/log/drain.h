#pragma once
#include <chrono>
#include <cstdint>

namespace mimesis::tool {

/// When to stop listening after the signal to stop: as soon as nothing that was published before it
/// has come for a while, however much the graph goes on talking.
class Drain {
 public:
  using WallTime = std::chrono::steady_clock::time_point;
  /// Without an old message for so long, none is under way any more.
  static constexpr std::chrono::milliseconds kQuiet{100};
  /// Whoever is further behind than this is not waited for.
  static constexpr std::chrono::seconds kAtMost{2};

  /// Begins at the signal.
  Drain(WallTime now, std::uint64_t wall_ns) : begin_(now), last_old_(now), wall_ns_(wall_ns) {}

  /// A message has come. `graph_time`: `time_ns` is a simulated time, else that of the wall clock.
  void received(WallTime now, bool graph_time, std::uint64_t time_ns);
  bool over(WallTime now) const;
  /// It is over because of kAtMost: what else was published before the signal is unknown.
  bool gave_up(WallTime now) const { return now - last_old_ < kQuiet; }

 private:
  WallTime begin_, last_old_;
  std::uint64_t wall_ns_;
  std::uint64_t graph_ns_ = 0;  ///< the latest simulated time that began before or with the signal
};

}  // namespace mimesis::tool
