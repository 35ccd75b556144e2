#pragma once
#include <chrono>
#include <string>

#include "common/time.h"

namespace mimesis::runtime {

/// Time of a graph on the wall clock: what the system clock said when the first node of the graph
/// started on this host, and monotonic time since then. Setting the system clock moves nothing.
class GraphTime {
 public:
  using WallTime = std::chrono::steady_clock::time_point;

  /// Takes the offset that the living nodes in `directory` share (file GRAPH/wall_clock, locked by
  /// each of them), or sets it if there are none.
  /// @throws ConfigError if the file cannot be used.
  explicit GraphTime(const std::string& directory);
  ~GraphTime();
  GraphTime(const GraphTime&) = delete;
  GraphTime& operator=(const GraphTime&) = delete;

  Time now() const { return std::chrono::steady_clock::now().time_since_epoch() + offset_; }
  /// When `now()` will be `t`.
  WallTime when(Time t) const { return WallTime(t - offset_); }
  /// How far the system clock was set ahead since the graph began.
  Time system_ahead() const;

 private:
  std::string path_;
  int lock_ = -1;
  Time offset_{};  ///< graph time - monotonic time
};

}  // namespace mimesis::runtime
