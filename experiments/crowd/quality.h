#pragma once
#include <functional>
#include <vector>

#include "experiments/crowd/movers.h"

namespace mimesis::crowd {

/// Where walkers are in each other's way. Discs of 0.2 m, 1.32 m/s; phases are coupled.
struct World {
  Crowd crowd;
  std::vector<Wall> walls{};
};

/// Two streams that cross at right angles, mixed from the start, to goals far ahead.
World streams(int n, double per_m2, const CrowdSettings& settings, unsigned seed);
/// From a corridor of 4 m through a door of 1.2 m; goals are set by `quality`.
World door(double per_m2, const CrowdSettings& settings, unsigned seed);

/// How well a crowd walks, mean of some seeds.
struct Quality {
  /// Pairs of discs deeper than 1 cm in each other, mean over time, per agent; between steps
  /// walkers go straight on. Both worlds.
  double overlaps;
  double flow_1_s;        ///< agents a second through the door, in 30 s
  double flow_error_1_s;  ///< standard error of that mean
  double delay_s;         ///< of the streams, against free walking for 6 s, mean over agents

  /// Nearly as good as the same method with its finest step: at most 0.001 overlaps per agent, a
  /// delay of at most 5 % and 0.02 s more, a flow of at most 5 % and two standard errors less.
  /// Methods differ in what they are for; this asks of each that its step spoils nothing of that.
  bool admissible(const Quality& finest) const;
};

using MakeMovers = std::function<std::unique_ptr<Movers>(World)>;
Quality quality(const MakeMovers& make, double per_m2, const CrowdSettings& settings);

}  // namespace mimesis::crowd
