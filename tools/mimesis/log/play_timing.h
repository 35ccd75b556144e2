#pragma once
#include <array>
#include <chrono>
#include <cstdint>

#include "common/time.h"

namespace mimesis::tool {

/// Where in the log a player is: t = t₀ + rate·(w − w₀) while it runs. Log times t [ns], wall times
/// w of the steady clock, which no one sets.
class PlayTimeline {
 public:
  using Wall = std::chrono::steady_clock::time_point;

  /// Stands at log time 0. `rate`: recorded seconds per second of wall time, above 0 [1]
  explicit PlayTimeline(double rate) : rate_(rate) {}

  bool running() const { return running_; }
  double rate() const { return rate_; }
  runtime::Time at(Wall now) const;
  /// When `log_time` is reached, as things are. Precondition: running.
  Wall due(runtime::Time log_time) const;

  void run(Wall now);
  void stand(Wall now);
  void set_rate(Wall now, double rate);
  void jump(Wall now, runtime::Time log_time);

 private:
  double rate_;
  bool running_ = false;
  Wall wall_{};
  runtime::Time log_time_{};
};

/// How late messages were played: counts in bins whose width is 1/32 of their octave, so quantiles
/// are at most 3 % too high. Does not allocate.
class PlayLateness {
 public:
  void add(runtime::Time late);  ///< too early counts as 0
  std::uint64_t count() const { return count_; }
  runtime::Time worst() const { return worst_; }
  /// Upper end of the bin below which `share` of all lie; 0 without any.
  runtime::Time quantile(double share) const;

 private:
  static constexpr std::size_t kPerOctave = 32, kOctaves = 60;
  std::array<std::uint64_t, kPerOctave * kOctaves> bins_{};
  std::uint64_t count_ = 0;
  runtime::Time worst_{};
};

}  // namespace mimesis::tool
