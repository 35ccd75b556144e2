#pragma once
#include <span>
#include <vector>

#include "nodes/planner/linkage.h"

namespace mimesis::planner {

/// Excitation of a wave that started at the goals.
struct Wave {
  std::vector<double> v;     ///< excitation vᵢ, 0 where the wave has not been [1]
  std::vector<int> arrival;  ///< time step at which the wave reached i, -1 never
  bool reached = false;      ///< it reached the start
};

/// Wave expansion [M18 2.3.2]: v = 1 at the goals at t = 0; each step an inactive node i that is
/// not inhibited and has active neighbours becomes active with vᵢ(t) = Σⱼ vⱼ(t−1) w(i, j), w(i, j)
/// = exp(−cᵢⱼ d(i, j)); active nodes do not interact. Stops when the start is active. cᵢⱼ =
/// (cost[i] + cost[j]) / 2 is 1 everywhere, or less in regions that F5 prefers (the cost reading of
/// pre-selection: a cheaper link is a stronger one); `cost` may be empty. O(links).
Wave expand_wave(const Linkage& links, std::span<const char> inhibited,
                 std::span<const double> cost, int start, std::span<const int> goals);

/// Backward search: from the start always to the maximally excited neighbour among those the wave
/// passed one step before, down to a goal. Empty if the wave did not reach the start.
std::vector<int> follow_wave(const Linkage& links, const Wave& wave, int start);

}  // namespace mimesis::planner
