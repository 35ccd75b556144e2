#pragma once
#include <span>

#include "experiments/crowd/movers.h"

namespace mimesis::crowd {

/// Usual values: step and number of neighbours of RVO2's examples lie between 0.1 and 0.25 s and at
/// 10; theirs are discs of 1.5 to 2 m, so the horizon is scaled to people.
struct Rvo2Settings {
  double step_s = 0.1;
  int threads = 1;
  int neighbours = 10;   ///< most others that an agent looks at
  double reach_m = 5.0;  ///< others further away are not seen, as in ours
  double horizon_s = 2.0, wall_horizon_s = 2.0;
  double most_m_s = 2.0;
};

/// The peer: RVO2 [van den Berg, Guy, Lin, Manocha, ISRR 2011], optimal reciprocal collision
/// avoidance of discs that can go everywhere at once. It computes positions and velocities only:
/// no heading dynamics, gait, step length or coupling. It looks at most at 10 others, ours at all
/// within reach.
class Rvo2 : public Movers {
 public:
  /// Agents of a crowd as they are: positions, discs, goals, or the direction of their lanes. Their
  /// wished speed is that of our agents alone. A step wishes velocities anew. Empty if RVO2 was not
  /// built in (`cmake --build build --target peers` fetches it).
  static std::unique_ptr<Rvo2> make(const Crowd& start, const Rvo2Settings& settings = {},
                                    std::span<const Wall> walls = {});
  /// Whether `make` makes any.
  static bool built();
};

}  // namespace mimesis::crowd
