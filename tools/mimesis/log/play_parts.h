#pragma once
#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdint>

#include "common/time.h"

// Where a player is in the log, and how late it is.
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
  runtime::Time at(Wall now) const {
    if (!running_) return log_time_;
    return log_time_ +
           runtime::Time(std::llround(rate_ * static_cast<double>((now - wall_).count())));
  }
  /// When `log_time` is reached, as things are. Precondition: running.
  Wall due(runtime::Time log_time) const {
    constexpr double kFar_ns = 1e18;  // 31 years
    const double left_ns = static_cast<double>((log_time - log_time_).count()) / rate_;
    return wall_ + std::chrono::nanoseconds(std::llround(std::clamp(left_ns, -kFar_ns, kFar_ns)));
  }

  void jump(Wall now, runtime::Time log_time) {
    wall_ = now;
    log_time_ = log_time;
  }
  void run(Wall now) {
    jump(now, at(now));
    running_ = true;
  }
  void stand(Wall now) {
    jump(now, at(now));
    running_ = false;
  }
  void set_rate(Wall now, double rate) {
    jump(now, at(now));
    rate_ = rate;
  }

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
  void add(runtime::Time late) {  ///< too early counts as 0
    const auto ns = static_cast<std::uint64_t>(std::max<runtime::Time::rep>(late.count(), 0));
    // The leading bit chooses the octave, the five below it the bin.
    const auto octave =
        static_cast<std::size_t>(std::max(static_cast<int>(std::bit_width(ns)) - 6, 0));
    const std::size_t bin = octave * kPerOctave + (ns >> octave);
    ++bins_[std::min(bin, bins_.size() - 1)];
    ++count_;
    worst_ = std::max(worst_, late);
  }
  std::uint64_t count() const { return count_; }
  runtime::Time worst() const { return worst_; }
  /// Upper end of the bin below which `share` of all lie; 0 without any.
  runtime::Time quantile(double share) const {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
    std::uint64_t below = 0;
    for (std::size_t bin = 0; bin < bins_.size() && count_ > 0; ++bin) {
      below += bins_[bin];
      if (below < std::max<std::uint64_t>(wanted, 1)) continue;
      // Inverse of `add`: bins below 64 hold one value each.
      const std::size_t octave = bin < 2 * kPerOctave ? 0 : bin / kPerOctave - 1;
      const std::uint64_t low = bin - octave * kPerOctave;
      return std::min(worst_, runtime::Time(((low + 1) << octave) - 1));
    }
    return {};
  }

 private:
  static constexpr std::size_t kPerOctave = 32, kOctaves = 60;
  std::array<std::uint64_t, kPerOctave * kOctaves> bins_{};
  std::uint64_t count_ = 0;
  runtime::Time worst_{};
};

}  // namespace mimesis::tool
