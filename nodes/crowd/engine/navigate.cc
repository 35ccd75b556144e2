// Headings and velocities of those who avoid others.
#include <algorithm>
#include <cmath>

#include "common/parallel/team.h"
#include "nodes/crowd/engine/contact.h"
#include "nodes/crowd/engine/crowd_impl.h"
#include "nodes/crowd/engine/lanes.h"
#include "nodes/crowd/engine/steer.h"

namespace mimesis::crowd {
namespace {

constexpr int kAround = 2;      // cells of a reach
constexpr double kSkin = 1e-4;  // gaps are taken smaller by this, for rounding [m]
// Who goes nowhere makes room for who touches it and wants to pass, or rings of those who have
// arrived would lock others out.
constexpr double kTouch = 0.1;          // gap [m]
constexpr double kIdle = 2.0;           // the other wants to go this much faster
constexpr float kObstacleDepth = 0.3F;  // an obstacle is felt as an agent that touches its surface

/// A direction for two who stand at the same point; the other's is opposite.
Eigen::Vector2d apart(AgentId self, AgentId other) {
  constexpr double kGolden = 2.39996322972865332;
  const CosSin d = cos_sin_lane(kGolden * static_cast<double>((self + other) % 100'000));
  const double side = self < other ? 1.0 : -1.0;
  return {side * d.cos, side * d.sin};
}

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

void Crowd::Impl::part_all(parallel::Team* team) {
  row_contacts.resize(static_cast<std::size_t>(grid.side()));
  parallel::for_each(team, grid.side(), [this](int row) { part_row(row); });
  for (const Contacts& c : row_contacts) {
    contacts.held += c.held;
    contacts.overlapping += c.overlapping;
    contacts.least_gap_m = std::min(contacts.least_gap_m, c.least_gap_m);
  }
}

void Crowd::Impl::part_row(int grid_row) {
  Contacts& found = row_contacts[static_cast<std::size_t>(grid_row)];
  found = {};
  const int first = grid.begin(grid_row * grid.side());
  const int last = grid.end((grid_row + 1) * grid.side() - 1);
  for (int i = first; i < last; ++i) part(i, found);
}

void Crowd::Impl::part(int place, Contacts& found) {
  const auto at = static_cast<std::size_t>(place), row = static_cast<std::size_t>(grid.row[at]);
  if (avoids[row] == 0) return;
  const double dt = settings.dt_s;
  Eigen::Vector2d v(wish_x[row], wish_y[row]);
  const Eigen::Vector2d p(grid.x[at], grid.y[at]);
  if (table.role[row] == Role::own) {
    v = parted(at, v, found);
    table.vx[row] = static_cast<float>(v.x());
    table.vy[row] = static_cast<float>(v.y());
  }
  table.x[row] = p.x() + dt * v.x();
  table.y[row] = p.y() + dt * v.y();
}

/// The wish within bounds by others and obstacles; of who is in another's disc, the way out.
Eigen::Vector2d Crowd::Impl::parted(std::size_t at, const Eigen::Vector2d& wish, Contacts& found) {
  const AvoidSettings& s = settings.avoid;
  const auto row = static_cast<std::size_t>(grid.row[at]);
  const Eigen::Vector2d p(grid.x[at], grid.y[at]);
  const Eigen::Vector2d u(static_cast<double>(grid.vx[at]), static_cast<double>(grid.vy[at]));
  const double radius = static_cast<double>(grid.radius[at]);
  const double fast = std::sqrt(wish.squaredNorm());
  const double range = std::min(
      s.reach_m, radius + grid.largest_radius() + kSkin +
                     2.0 * s.headway_s * (std::max(fast, s.separate_m_s) + grid.fastest()));
  Bounds bounds;
  Eigen::Vector2d out = Eigen::Vector2d::Zero();
  bool inside = false;
  Eigen::Vector2d pushed = Eigen::Vector2d::Zero();
  double strongest = 0.0;
  const auto meet = [&](const Eigen::Vector2d& n, double gap, double limit) {
    found.least_gap_m = std::min(found.least_gap_m, gap);
    if (gap < 0.0) {
      inside = true;
      out += gap * n;
    } else {
      bounds.add({n, limit});
    }
  };
  const int around = static_cast<int>(std::ceil(range / grid.cell_m()));
  grid.for_each_range(grid.cell_at(p.x(), p.y()), around, [&](int from, int to) {
    for (auto j = static_cast<std::size_t>(from); j < static_cast<std::size_t>(to); ++j) {
      const double dx = grid.x[j] - p.x(), dy = grid.y[j] - p.y();
      const double d2 = dx * dx + dy * dy;
      if (d2 > range * range || j == at) continue;
      const double d = std::sqrt(d2);
      const Eigen::Vector2d n =
          d > 1e-9 ? Eigen::Vector2d(dx / d, dy / d)
                   : apart(table.id[row], table.id[static_cast<std::size_t>(grid.row[j])]);
      const double gap = d - (radius + static_cast<double>(grid.radius[j]));
      const Eigen::Vector2d other(static_cast<double>(grid.vx[j]), static_cast<double>(grid.vy[j]));
      const double limit = grid.yields[j] != 0 ? shared_limit(gap - kSkin, s.headway_s,
                                                              0.5 * (u.dot(n) + other.dot(n)))
                                               : lone_limit(gap - kSkin, s.headway_s, other.dot(n));
      meet(n, gap, limit);
      const auto other_row = static_cast<std::size_t>(grid.row[j]);
      if (gap > kTouch || avoids[other_row] == 0) continue;
      const double push = -(wish_x[other_row] * n.x() + wish_y[other_row] * n.y());
      if (push < kIdle * fast) continue;
      pushed -= push * n;
      strongest = std::max(strongest, push);
    }
  });
  obstacles.for_each_near(p, [&](const Obstacles::Near& o) {
    const double gap = o.distance_m - radius;
    meet(o.n, gap, lone_limit(gap - kSkin, s.headway_s, 0.0));
  });
  Eigen::Vector2d v = wish;
  if (strongest > 0.0) {
    const double length = std::sqrt(pushed.squaredNorm());
    v += length > strongest ? Eigen::Vector2d(pushed * (strongest / length)) : pushed;
  }
  if (inside) {
    ++found.overlapping;
    const double deep = std::sqrt(out.squaredNorm());
    // No faster than out in one headway, so that it does not swing.
    v = deep > 1e-12 ? Eigen::Vector2d(out * (std::min(s.separate_m_s, deep / s.headway_s) / deep))
                     : Eigen::Vector2d::Zero();
  }
  const Eigen::Vector2d within = bounds.nearest(v);
  if (within != v) ++found.held;
  return within;
}

}  // namespace mimesis::crowd
