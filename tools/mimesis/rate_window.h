#pragma once
#include <algorithm>
#include <chrono>
#include <cstdint>
#include <deque>
#include <limits>
#include <optional>

#include "common/time.h"

namespace mimesis::tool {

/// Rate of one topic over its last messages. Counts sequence numbers, not arrivals: right although
/// the tool's own subscription may drop messages.
class RateWindow {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// @param size number of messages in the window, >= 2
  explicit RateWindow(std::size_t size) : size_(size) {}

  void add(Time arrival, std::uint64_t seq) {
    // A smaller number: the publisher was started again.
    if (!arrivals_.empty() && seq <= arrivals_.back().seq) arrivals_.clear();
    arrivals_.push_back({arrival, seq});
    if (arrivals_.size() > size_) arrivals_.pop_front();
  }

  struct Rate {
    double hz = 0.0;
    double min_s = 0.0, max_s = 0.0;  ///< time between messages that followed each other
    std::uint64_t messages = 0;       ///< published within the window
  };
  /// From two messages on.
  std::optional<Rate> rate() const {
    if (arrivals_.size() < 2) return std::nullopt;
    Rate rate;
    rate.messages = arrivals_.back().seq - arrivals_.front().seq;
    const double span = to_seconds(arrivals_.back().time - arrivals_.front().time);
    if (span <= 0.0) return std::nullopt;
    rate.hz = static_cast<double>(rate.messages) / span;
    rate.min_s = std::numeric_limits<double>::infinity();
    for (std::size_t i = 1; i < arrivals_.size(); ++i) {
      if (arrivals_[i].seq != arrivals_[i - 1].seq + 1) continue;
      const double gap = to_seconds(arrivals_[i].time - arrivals_[i - 1].time);
      rate.min_s = std::min(rate.min_s, gap);
      rate.max_s = std::max(rate.max_s, gap);
    }
    if (rate.max_s == 0.0) rate.min_s = 0.0;  // none followed another directly
    return rate;
  }

 private:
  struct Arrival {
    Time time;
    std::uint64_t seq;
  };
  std::size_t size_;
  std::deque<Arrival> arrivals_;
};

}  // namespace mimesis::tool
