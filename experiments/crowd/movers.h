#pragma once
#include <Eigen/Core>
#include <memory>

#include "nodes/crowd/engine/crowd.h"

namespace mimesis::crowd {

/// Moves a crowd: the engine, or the peer.
class Movers {
 public:
  virtual ~Movers() = default;
  virtual void step() = 0;
  virtual double time_s() const = 0;
  virtual int size() const = 0;
  virtual Eigen::Vector2d position_W_m(int agent) const = 0;  ///< in the order of rows
  virtual void set_goal(int agent, const Eigen::Vector2d& goal_W_m) = 0;
};

/// The engine on as many threads.
std::unique_ptr<Movers> move_by_engine(Crowd crowd, int threads);

}  // namespace mimesis::crowd
