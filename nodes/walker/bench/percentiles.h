#pragma once
#include <benchmark/benchmark.h>
#include <time.h>

#include <algorithm>
#include <vector>

namespace mimesis::walker {

/// Times of single calls on the processor, beyond the mean: median, 99th percentile and longest
/// [µs] as counters of a benchmark. Other processes do not count, the reading of the clock (0.3 µs)
/// does.
class Percentiles {
 public:
  Percentiles() { us_.reserve(1 << 20); }
  /// @return what this call took [µs]
  template <typename Call>
  double time(Call&& call) {
    const double from = now_us();
    call();
    us_.push_back(now_us() - from);
    return us_.back();
  }
  void report(benchmark::State& state) {
    if (us_.empty()) return;
    std::sort(us_.begin(), us_.end());
    const auto at = [&](double share) {
      return us_[static_cast<std::size_t>(share * static_cast<double>(us_.size() - 1))];
    };
    state.counters["median_us"] = at(0.5);
    state.counters["p99_us"] = at(0.99);
    state.counters["max_us"] = us_.back();
  }

 private:
  static double now_us() {
    timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return 1e6 * static_cast<double>(now.tv_sec) + 1e-3 * static_cast<double>(now.tv_nsec);
  }

  std::vector<double> us_;
};

}  // namespace mimesis::walker
