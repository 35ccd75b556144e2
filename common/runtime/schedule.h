#pragma once
#include <cmath>
#include <cstdint>

#include "common/time.h"

namespace mimesis::runtime {

/// Due times base + offset + k/rate, k = 0, 1, ...: rounded each for itself, so that they do not
/// drift.
class Schedule {
 public:
  Schedule(double rate_hz, double offset_s, Time base)
      : period_ns_(1e9 / rate_hz), first_(base + from_seconds(offset_s)) {}

  Time due() const { return at(k_); }
  void advance() { ++k_; }
  /// Goes on to the first due time after `now`; the number of due times left out.
  std::int64_t skip_past(Time now) {
    const std::int64_t before = k_;
    const double periods = static_cast<double>((now - first_).count()) / period_ns_;
    if (const auto k = static_cast<std::int64_t>(periods); k > k_) k_ = k;
    while (due() <= now) ++k_;
    return k_ - before;
  }

 private:
  Time at(std::int64_t k) const {
    return first_ + Time(std::llround(static_cast<double>(k) * period_ns_));
  }

  double period_ns_;
  Time first_;
  std::int64_t k_ = 0;
};

}  // namespace mimesis::runtime
