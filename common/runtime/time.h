#pragma once
#include <chrono>

namespace mimesis::runtime {

/// Graph time: nanoseconds since the epoch of the graph's clock (wall clock: 1970; simulated: its
/// start).
using Time = std::chrono::nanoseconds;

inline double to_seconds(Time t) { return std::chrono::duration<double>(t).count(); }

inline Time from_seconds(double seconds) {
  return std::chrono::duration_cast<Time>(std::chrono::duration<double>(seconds));
}

}  // namespace mimesis::runtime
