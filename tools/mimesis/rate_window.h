#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>

namespace mimesis::tool {

/// Rate of one topic over its last messages. Counts sequence numbers, not arrivals: right although
/// the tool's own subscription may drop messages.
class RateWindow {
 public:
  using Time = std::chrono::steady_clock::time_point;
  /// @param size number of messages in the window, >= 2
  explicit RateWindow(std::size_t size) : size_(size) {}

  void add(Time arrival, std::uint64_t seq);

  struct Rate {
    double hz = 0.0;
    double min_s = 0.0, max_s = 0.0;  ///< time between messages that followed each other
    std::uint64_t messages = 0;       ///< published within the window
  };
  std::optional<Rate> rate() const;  ///< from two messages on

 private:
  struct Arrival {
    Time time;
    std::uint64_t seq;
  };
  std::size_t size_;
  std::deque<Arrival> arrivals_;
};

}  // namespace mimesis::tool
