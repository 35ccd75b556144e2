#include "nodes/crowd/engine/grid.h"

#include <algorithm>

namespace mimesis::crowd {

void Grid::build(const Table& t, const std::vector<std::uint8_t>& avoids, double cell_m) {
  const auto n = static_cast<std::size_t>(t.size());
  cell_m_ = cell_m;
  while ((std::size_t{1} << (2 * bits_)) < n) ++bits_;
  const std::int64_t mask = side() - 1;
  const std::size_t cells = std::size_t{1} << (2 * bits_);
  start_.assign(cells + 1, 0);
  cell_.resize(n);
  for (auto* column : {&x, &y}) column->resize(n + kPad);
  for (auto* column : {&vx, &vy, &radius}) column->resize(n + kPad);
  yields.resize(n + kPad);
  pressed.resize(n + kPad);
  row.resize(n + kPad);
  const double per = 1.0 / cell_m;
  for (std::size_t i = 0; i < n; ++i) {
    const Cell c = cell_of(t.x[i], t.y[i], per);
    cell_[i] = static_cast<int>(((c.y & mask) << bits_) | (c.x & mask));
    ++start_[static_cast<std::size_t>(cell_[i]) + 1];
  }
  for (std::size_t c = 0; c < cells; ++c) start_[c + 1] += start_[c];
  next_.assign(start_.begin(), start_.end() - 1);
  float largest = 0.0F, fastest = 0.0F;
  for (std::size_t i = 0; i < n; ++i) {
    const auto to = static_cast<std::size_t>(next_[static_cast<std::size_t>(cell_[i])]++);
    x[to] = t.x[i];
    y[to] = t.y[i];
    vx[to] = t.vx[i];
    vy[to] = t.vy[i];
    radius[to] = t.radius[i];
    const Role role = t.role[i];
    yields[to] = role == Role::own ? avoids[i] : crowd::yields(role);
    pressed[to] = t.pressed[i];
    row[to] = static_cast<int>(i);
    largest = std::max(largest, t.radius[i]);
    fastest = std::max(fastest, t.vx[i] * t.vx[i] + t.vy[i] * t.vy[i]);
  }
  largest_radius_ = static_cast<double>(largest);
  fastest_ = std::sqrt(static_cast<double>(fastest));
}

}  // namespace mimesis::crowd
