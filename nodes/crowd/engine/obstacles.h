#pragma once
#include <Eigen/Core>
#include <span>
#include <utility>
#include <vector>

#include "nodes/crowd/engine/crowd.h"
#include "nodes/crowd/engine/grid.h"

namespace mimesis::crowd {

/// Pillars and walls, by the cells from which they are within reach.
class Obstacles {
 public:
  /// @throws ConfigError for values that are not finite, and radii that are not positive
  Obstacles(std::span<const Pillar> pillars, std::span<const Wall> walls, double reach_m);
  Obstacles() = default;

  bool empty() const { return shapes_.empty(); }

  struct Near {
    Eigen::Vector2d n;  ///< unit vector to its nearest point, or into it
    double distance_m;  ///< to its surface; negative inside a pillar
  };
  /// Calls f(Near) for those within reach of a point, in the order given. Does not allocate.
  template <class F>
  void for_each_near(const Eigen::Vector2d& p, F&& f) const {
    if (empty()) return;
    const Cell c = cell_of(p.x(), p.y(), 1.0 / cell_m_);
    const std::size_t at = bucket(c);
    int before = -1;  // cells that are the same on the torus may name a shape twice
    for (int k = start_[at]; k < start_[at + 1]; ++k) {
      const int shape = list_[static_cast<std::size_t>(k)];
      if (std::exchange(before, shape) == shape) continue;
      const Near near = nearest(shapes_[static_cast<std::size_t>(shape)], p);
      if (near.distance_m < cell_m_) f(near);
    }
  }

 private:
  struct Shape {
    Eigen::Vector2d from, to;
    double radius;
  };
  static Near nearest(const Shape& shape, const Eigen::Vector2d& p);
  std::size_t bucket(Cell c) const {
    const std::int64_t mask = (std::int64_t{1} << bits_) - 1;
    return static_cast<std::size_t>(((c.y & mask) << bits_) | (c.x & mask));
  }

  double cell_m_ = 1.0;  // the reach
  int bits_ = 3;
  std::vector<Shape> shapes_;
  std::vector<int> start_, list_;
};

}  // namespace mimesis::crowd
