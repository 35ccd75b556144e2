// Headings of those who avoid others.
#include <algorithm>
#include <cmath>

#include "common/parallel/team.h"
#include "nodes/crowd/engine/crowd_impl.h"
#include "nodes/crowd/engine/lanes.h"
#include "nodes/crowd/engine/steer.h"

namespace mimesis::crowd {
namespace {

constexpr int kAround = 2;              // cells of a reach
constexpr float kObstacleDepth = 0.3F;  // an obstacle is felt as an agent that touches its surface

}  // namespace

void Crowd::Impl::steer_all(parallel::Team* team) {
  grid.build(table, avoids, settings.avoid.reach_m / kAround);
  parallel::for_each(team, grid.side(), [this](int row) { steer_row(row); });
}

void Crowd::Impl::steer_row(int grid_row) {
  const SteerParams params(settings.avoid.navigation, settings.avoid.reach_m);
  Surroundings near;
  const auto steered = [&](std::size_t i, const Eigen::Vector2d& origin) {
    const CosSin h = cos_sin_lane(table.heading[static_cast<std::size_t>(grid.row[i])]);
    return Steered{static_cast<float>(grid.x[i] - origin.x()),
                   static_cast<float>(grid.y[i] - origin.y()),
                   grid.vx[i],
                   grid.vy[i],
                   static_cast<float>(h.cos),
                   static_cast<float>(h.sin)};
  };
  const auto is_ours = [&](std::size_t i) {
    const auto row = static_cast<std::size_t>(grid.row[i]);
    return avoids[row] != 0;
  };
  for (int cell = grid_row * grid.side(); cell < (grid_row + 1) * grid.side(); ++cell) {
    const auto begin = static_cast<std::size_t>(grid.begin(cell));
    const auto end = static_cast<std::size_t>(grid.end(cell));
    for (std::size_t first = begin; first < end; ++first) {
      const Cell here = grid.cell_at(grid.x[first], grid.y[first]);
      const auto same = [&](std::size_t i) { return grid.cell_at(grid.x[i], grid.y[i]) == here; };
      bool done = false;
      for (std::size_t i = begin; i < first; ++i) done = done || same(i);
      if (done) continue;
      const Eigen::Vector2d origin((static_cast<double>(here.x) + 0.5) * grid.cell_m(),
                                   (static_cast<double>(here.y) + 0.5) * grid.cell_m());
      const auto flush = [&] {
        near.pad();
        for (std::size_t i = first; i < end; ++i) {
          if (!is_ours(i) || !same(i)) continue;
          turn[static_cast<std::size_t>(grid.row[i])] +=
              static_cast<double>(steer(near, steered(i, origin), params));
        }
        near.count = 0;
      };
      near.count = 0;
      grid.for_each_range(here, kAround, [&](int from, int to) {
        for (auto j = static_cast<std::size_t>(from); j < static_cast<std::size_t>(to); ++j) {
          near.add(grid.x[j] - origin.x(), grid.y[j] - origin.y(), grid.vx[j], grid.vy[j]);
          if (near.full()) flush();
        }
      });
      if (near.count > 0) flush();
      if (obstacles.empty()) continue;
      for (std::size_t i = first; i < end; ++i) {
        if (!is_ours(i) || !same(i)) continue;
        const Eigen::Vector2d p(grid.x[i], grid.y[i]);
        obstacles.for_each_near(p, [&](const Obstacles::Near& o) {
          const Eigen::Vector2d at = (o.distance_m + static_cast<double>(kObstacleDepth)) * o.n;
          if (!near.full()) near.add(at.x(), at.y(), 0.0F, 0.0F);
        });
        if (near.count == 0) continue;
        near.pad();
        turn[static_cast<std::size_t>(grid.row[i])] +=
            static_cast<double>(steer(near, steered(i, p), params));
        near.count = 0;
      }
    }
  }
}

}  // namespace mimesis::crowd
