#pragma once
#include <chrono>

namespace mimesis {

/// Graph time: nanoseconds since the epoch of the graph's clock (wall clock: 1970; simulated: its
/// start).
using Time = std::chrono::nanoseconds;

/// Any duration in seconds [s]. Differences of time points, too: `to_seconds(clock::now() -
/// start)`.
constexpr double to_seconds(std::chrono::duration<double> t) { return t.count(); }

/// Rounded towards zero.
constexpr Time from_seconds(double seconds) {
  return std::chrono::duration_cast<Time>(std::chrono::duration<double>(seconds));
}

}  // namespace mimesis

namespace mimesis::runtime {
using mimesis::from_seconds;
using mimesis::Time;
using mimesis::to_seconds;
}  // namespace mimesis::runtime
