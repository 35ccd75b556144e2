#pragma once
#include <chrono>
#include <cstdint>
#include <string>

#include "common/time.h"

namespace mimesis::runtime {

/// System clock - monotonic time of this host.
Time system_offset();

/// Time of a graph on the wall clock: what the system clock said when the first node of the graph
/// started on this host, and monotonic time since then. Setting the system clock moves nothing. On
/// several hosts it is the time of the launcher's host: there `set_offset` follows that clock, so
/// that stamps and ages mean the same everywhere.
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

  Time now() const { return std::chrono::steady_clock::now().time_since_epoch() + offset(); }
  /// When `now()` will be `t`.
  WallTime when(Time t) const { return WallTime(t - offset()); }
  /// How far the system clock was set ahead since this object was made.
  Time system_ahead() const;
  /// Graph time - monotonic time, in all processes of this host.
  Time offset() const { return Time(__atomic_load_n(&shared_->offset_ns, __ATOMIC_RELAXED)); }
  void set_offset(Time offset);

 private:
  /// GRAPH/wall_clock, mapped. The text is for whoever comes first and for Python.
  struct Shared {
    char text[32];
    std::int64_t offset_ns;
  };
  std::string path_;
  int lock_ = -1;
  Shared* shared_ = nullptr;
  Time system_;  ///< system clock - monotonic time at first
};

}  // namespace mimesis::runtime
