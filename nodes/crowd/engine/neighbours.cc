#include "nodes/crowd/engine/neighbours.h"

#include <algorithm>
#include <string>

#include "common/error.h"

namespace mimesis::crowd {

std::int64_t Grid::count(const AgentTable& t, double cell_m) {
  const auto n = static_cast<std::size_t>(t.size());
  cell_m_ = cell_m;
  start_.assign((std::size_t{1} << (2 * bits_)) + 1, 0);
  const double per = 1.0 / cell_m;
  std::int64_t squares = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const Cell c = cell_by_row_[i] = cell_of(t.x[i], t.y[i], per);
    squares += 2 * start_[torus(c)]++ + 1;
  }
  return squares;
}

void Grid::build(const AgentTable& t, const std::vector<std::uint8_t>& avoids, double reach_m) {
  const auto n = static_cast<std::size_t>(t.size());
  while ((std::size_t{1} << (2 * bits_)) < 4 * n) ++bits_;  // few cells are another's, too
  for (auto* column : {&x, &y}) column->resize(n + kPad);
  for (auto* column : {&vx, &vy, &radius}) column->resize(n + kPad);
  yields.resize(n + kPad);
  pressed.resize(n + kPad);
  row.resize(n + kPad);
  cell.resize(n);
  cell_by_row_.resize(n);
  cells_of_reach_ = 4;
  if (count(t, reach_m / cells_of_reach_) > kCrowded * static_cast<std::int64_t>(n)) {
    cells_of_reach_ = 8;
    count(t, reach_m / cells_of_reach_);
  }
  for (std::size_t c = 1; c < start_.size(); ++c) start_[c] += start_[c - 1];
  float largest = 0.0F, fastest = 0.0F;
  for (std::size_t i = n; i-- > 0;) {  // ends of the cells become their begins
    const Cell c = cell_by_row_[i];
    const auto to = static_cast<std::size_t>(--start_[torus(c)]);
    cell[to] = c;
    x[to] = t.x[i];
    y[to] = t.y[i];
    vx[to] = t.vx[i];
    vy[to] = t.vy[i];
    radius[to] = t.radius[i];
    yields[to] = t.role[i] == Role::own ? avoids[i] : 0;
    pressed[to] = t.pressed[i];
    row[to] = static_cast<int>(i);
    largest = std::max(largest, t.radius[i]);
    fastest = std::max(fastest, t.vx[i] * t.vx[i] + t.vy[i] * t.vy[i]);
  }
  largest_radius_ = static_cast<double>(largest);
  fastest_ = std::sqrt(static_cast<double>(fastest));
}

ObstacleGrid::ObstacleGrid(std::span<const Pillar> pillars, std::span<const Wall> walls,
                           double reach_m)
    : cell_m_(reach_m) {
  for (const Pillar& p : pillars) shapes_.push_back({p.position_W_m, p.position_W_m, p.radius_m});
  for (const Wall& w : walls) shapes_.push_back({w.from_W_m, w.to_W_m, 0.0});
  constexpr std::int64_t kMostCells = 10'000'000;
  // All cells that meet the box around the shape and its reach.
  std::vector<std::pair<Cell, int>> places;
  std::int64_t total = 0;
  for (std::size_t s = 0; s < shapes_.size(); ++s) {
    const double wide = shapes_[s].radius + reach_m;
    const Eigen::Vector2d low = shapes_[s].from.cwiseMin(shapes_[s].to).array() - wide;
    const Eigen::Vector2d high = shapes_[s].from.cwiseMax(shapes_[s].to).array() + wide;
    const Cell a = cell_of(low.x(), low.y(), 1.0 / cell_m_);
    const Cell b = cell_of(high.x(), high.y(), 1.0 / cell_m_);
    const double cells = (high - low).prod() / (cell_m_ * cell_m_);
    if (cells > kMostCells || (total += static_cast<std::int64_t>(cells)) > kMostCells) {
      throw ConfigError("crowd: obstacles are too large for a reach of " + std::to_string(reach_m) +
                        " m");
    }
    for (std::int64_t y = a.y; y <= b.y; ++y) {
      for (std::int64_t x = a.x; x <= b.x; ++x) {
        const Eigen::Vector2d middle((static_cast<double>(x) + 0.5) * cell_m_,
                                     (static_cast<double>(y) + 0.5) * cell_m_);
        if (nearest(shapes_[s], middle).distance_m < 1.75 * cell_m_) {
          places.emplace_back(Cell{x, y}, static_cast<int>(s));
        }
      }
    }
  }
  while ((std::size_t{1} << (2 * bits_)) < places.size()) ++bits_;
  start_.assign((std::size_t{1} << (2 * bits_)) + 1, 0);
  for (const auto& [cell, shape] : places) ++start_[bucket(cell) + 1];
  for (std::size_t c = 0; c + 1 < start_.size(); ++c) start_[c + 1] += start_[c];
  std::vector<int> next(start_.begin(), start_.end() - 1);
  list_.resize(places.size());
  for (const auto& [cell, shape] : places) {
    list_[static_cast<std::size_t>(next[bucket(cell)]++)] = shape;
  }
  for (std::size_t c = 0; c + 1 < start_.size(); ++c) {
    const auto first = list_.begin() + start_[c], last = list_.begin() + start_[c + 1];
    std::sort(first, last);
  }
}

ObstacleGrid::Near ObstacleGrid::nearest(const Shape& s, const Eigen::Vector2d& p) {
  const Eigen::Vector2d along = s.to - s.from;
  const double length2 = along.squaredNorm();
  const double t = length2 > 0.0 ? std::clamp(along.dot(p - s.from) / length2, 0.0, 1.0) : 0.0;
  const Eigen::Vector2d to = s.from + t * along - p;
  const double d = std::sqrt(to.squaredNorm());
  if (d > 1e-12) return {to / d, d - s.radius};
  const Eigen::Vector2d across(-along.y(), along.x());  // on the wall, or in the middle of a pillar
  const double length = std::sqrt(length2);
  return {length > 0.0 ? Eigen::Vector2d(across / length) : Eigen::Vector2d::UnitX(), d - s.radius};
}

}  // namespace mimesis::crowd
