#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "nodes/crowd/engine/agent.h"
#include "nodes/crowd/engine/crowd.h"

namespace mimesis::crowd {

struct Cell {
  std::int64_t x, y;
  bool operator==(const Cell&) const = default;
};
inline Cell cell_of(double x_m, double y_m, double per_cell_1_m) {
  const auto below = [](double v) {  // floor, which would be called
    const auto n = static_cast<std::int64_t>(v);
    return n - (static_cast<double>(n) > v ? 1 : 0);
  };
  return {below(x_m * per_cell_1_m), below(y_m * per_cell_1_m)};
}

/// Agents sorted by square cells of the plane, by counting; cells are those of a torus of 2^k × 2^k
/// cells, so that the crowd may be anywhere and spread far. Within a cell agents keep the order of
/// their rows: sums over neighbours do not depend on the order of adding agents.
class Grid {
 public:
  static constexpr int kPad = 16;  ///< padding of the columns, which may be read

  /// A copy of what neighbours see, in the order of the cells.
  std::vector<double> x, y;
  std::vector<float> vx, vy, radius;
  std::vector<std::uint8_t> yields;  ///< half of the distance needed to keep apart
  std::vector<std::uint8_t> pressed;
  std::vector<int> row;
  std::vector<Cell> cell;  ///< of the plane

  /// Cells are a quarter of the reach, an eighth in a crowd.
  /// @param avoids  by row: of a group that avoids
  void build(const AgentTable& table, const std::vector<std::uint8_t>& avoids, double reach_m);

  double cell_m() const { return cell_m_; }
  int cells_of_reach() const { return cells_of_reach_; }
  Cell cell_at(double x_m, double y_m) const { return cell_of(x_m, y_m, 1.0 / cell_m_); }
  int side() const { return 1 << bits_; }
  double largest_radius() const { return largest_radius_; }
  double fastest() const { return fastest_; }  ///< speed [m/s]
  int begin(int c) const { return start_[static_cast<std::size_t>(c)]; }
  int end(int c) const { return start_[static_cast<std::size_t>(c) + 1]; }

  /// Calls f(begin, end) for the agents in the cells from `low` to `high`, row by row; at most two
  /// ranges a row. Others may be among them whose cell is the same on the torus.
  /// @pre fewer than `side` cells a side
  template <class F>
  void for_each_range(Cell low, Cell high, F&& f) const {
    const std::int64_t mask = side() - 1;
    const int first = static_cast<int>(low.x & mask);
    const int last = first + static_cast<int>(high.x - low.x);
    for (std::int64_t y_of = low.y; y_of <= high.y; ++y_of) {
      const int base = static_cast<int>(y_of & mask) << bits_;
      const int right = last < side() ? last : side() - 1;
      f(begin(base + first), end(base + right));
      if (last >= side()) f(begin(base), end(base + last - side()));
    }
  }

 private:
  /// Counts agents by cells of this size; returns Σ count² over the cells.
  std::int64_t count(const AgentTable& table, double cell_m);

  std::size_t torus(Cell c) const {
    const std::int64_t mask = side() - 1;
    return static_cast<std::size_t>(((c.y & mask) << bits_) | (c.x & mask));
  }

  /// More agents than this in the cell of the mean agent make a crowd.
  static constexpr std::int64_t kCrowded = 2;
  double cell_m_ = 1.0, largest_radius_ = 0.0, fastest_ = 0.0;
  int bits_ = 5, cells_of_reach_ = 1;  // more cells a side than `for_each_range` looks at
  std::vector<int> start_;
  std::vector<Cell> cell_by_row_;
};

/// Pillars and walls, by the cells from which they are within reach.
class ObstacleGrid {
 public:
  /// @throws ConfigError if they are too large
  ObstacleGrid(std::span<const Pillar> pillars, std::span<const Wall> walls, double reach_m);
  ObstacleGrid() = default;

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
