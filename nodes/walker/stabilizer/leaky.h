#pragma once
#include <algorithm>
#include <cmath>

#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

/// Share of the new sample in a first-order low-pass of one tick; 1 without a filter.
inline double low_pass_share(double time_s) {
  return time_s > 0.0 ? -std::expm1(-kTick_s / time_s) : 1.0;
}

/// One tick of x' = rate − x/leak, |x| <= limit (Euler).
inline double leaky(double x, double rate, double leak_s, double limit) {
  return std::clamp(x + kTick_s * (rate - x / leak_s), -limit, limit);
}

/// One tick of a first-order decay to 0.
inline double decayed(double x, double time_s) { return x * std::exp(-kTick_s / time_s); }

}  // namespace mimesis::walker
