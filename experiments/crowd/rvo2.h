#pragma once
#include <Eigen/Core>
#include <memory>

#include "nodes/crowd/engine/crowd.h"

namespace mimesis::crowd {

/// The peer: RVO2 [van den Berg, Guy, Lin, Manocha, ISRR 2011], optimal reciprocal collision
/// avoidance of discs that can go everywhere at once. It computes positions and velocities only:
/// no heading dynamics, gait, step length or coupling. It looks at most at 10 others, ours at all
/// within reach.
class Rvo2 {
 public:
  static constexpr double kStep_s = 0.1;
  static constexpr int kNeighbours = 10;
  static constexpr double kReach_m = 5.0, kHorizon_s = 2.0, kMost_m_s = 2.0;

  /// Agents of a crowd as they are: positions, discs, goals, or the direction of their lanes. Their
  /// wished speed is that of our agents alone. Empty if RVO2 was not built in (`cmake --build build
  /// --target peers` fetches it).
  static std::unique_ptr<Rvo2> make(const Crowd& start, int threads);
  /// Whether `make` makes any.
  static bool built();

  virtual ~Rvo2() = default;
  /// Wished velocities of all, and a step of `kStep_s`.
  virtual void step() = 0;
  virtual double time_s() const = 0;
  virtual int size() const = 0;
  virtual Eigen::Vector2d position_W_m(int agent) const = 0;  ///< in the order of rows
};

}  // namespace mimesis::crowd
