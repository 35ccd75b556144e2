#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "common/math/vector_clones.h"
#include "common/parallel/team.h"
#include "nodes/crowd/engine/crowd_impl.h"
#include "nodes/crowd/engine/steer.h"
#include "nodes/crowd/rules/lanes.h"

namespace mimesis::crowd {

void Surroundings::pad() {
  const int end = (count + kLanes - 1) / kLanes * kLanes;
  for (int i = count; i < end; ++i) {
    x[i] = y[i] = 1e9F;
    vx[i] = vy[i] = 0.0F;
  }
}

SteerParams::SteerParams(const NavigationParams& p, double reach_m)
    : avoid(static_cast<float>(p.avoid_1_s)),
      predict(static_cast<float>(p.predict_1_s)),
      angle(static_cast<float>(0.5 / (p.sigma_angle_rad * p.sigma_angle_rad))),
      distance(static_cast<float>(0.5 / (p.sigma_distance_m * p.sigma_distance_m))),
      per_horizon(static_cast<float>(1.0 / p.horizon_s)),
      cos_right(static_cast<float>(std::cos(p.keep_right_rad))),
      sin_right(static_cast<float>(std::sin(p.keep_right_rad))),
      reach2(static_cast<float>(reach_m * reach_m)) {}

MIMESIS_VECTOR_CLONES
float steer(const Surroundings& around, const Steered& self, const SteerParams& params) {
  return rows::steer_around(around, self, params);
}

namespace {

constexpr int kAround = 4;  // cells of a reach
// An agent in a crowd avoids the near ones only: all in the smallest square of cells that contains
// so many agents or covers the reach.
constexpr int kEnough = 32;
constexpr float kObstacleDepth = 0.3F;  // an obstacle is felt as an agent that touches its surface

constexpr double kSkin = 1e-4;  // gaps are taken smaller by this, for rounding [m]
constexpr double kClear =
    1e-3;  // gap at which an agent leaves another's disc; without it, it would never be out [m]
constexpr double kRounding = 1e-9;  // bounds are kept to this [m/s]
constexpr double kTouch = 0.1;      // gap at which agents push each other [m]
// An agent at rest makes room for one that touches it and wants to pass, or rings of agents that
// have arrived would lock others out.
constexpr double kIdle = 2.0;  // the other wants to go this much faster

constexpr double kStill = 0.3;  // an agent slower than this share of its wish counts as held
constexpr double kAside = 0.1;  // less of a step aside than this part is no room

// Who is held up for longer than kPatience_s, or does not get nearer to its goal, looks for a way
// round: it turns its wish to the right, then to the left, then further, each for as long, until it
// gets on.
constexpr std::array kRound_rad = {0.0, 0.9, -0.9, 1.8, -1.8};
constexpr double kOnward = 0.2;  // slower onward than this share of its pace is held up

std::size_t way_round(double held_s) { return static_cast<std::size_t>(held_s / kPatience_s); }

/// AgentState::held_s after a step. A way round is tried to its end, straight ahead until it fails.
/// @param on  the agent gets on along its wish
double held_after(double held_s, bool on, double dt_s) {
  const double after = held_s + dt_s;
  const std::size_t way = way_round(held_s);
  if (way == 0) return on ? std::max(0.0, held_s - dt_s) : after;
  const bool straight = way % kRound_rad.size() == 0, ends = way_round(after) != way;
  return on && (straight || ends) ? 0.0 : after;
}

/// The point nearest to `wish` on a line that is within other bounds.
bool on_line(const Eigen::Vector2d& wish, const Bound& line, std::span<const Bound* const> others,
             Eigen::Vector2d& best) {
  const double per = 1.0 / line.n.squaredNorm();  // n may have been rounded
  const Eigen::Vector2d along(-line.n.y(), line.n.x()), foot = line.limit_m_s * per * line.n;
  double low = -std::numeric_limits<double>::infinity(), high = -low;
  for (const Bound* other : others) {
    const double slope = other->n.dot(along);
    const double room = other->limit_m_s - other->n.dot(foot);
    if (std::abs(slope) < 1e-12) {
      if (room < -kRounding) return false;
    } else if (slope > 0.0) {
      high = std::min(high, room / slope);
    } else {
      low = std::max(low, room / slope);
    }
  }
  if (low > high + kRounding) return false;
  best = foot +
         (low > high ? 0.5 * (low + high) : std::clamp(wish.dot(along) * per, low, high)) * along;
  return true;
}

/// A direction for two agents at the same point; the other's is opposite.
Eigen::Vector2d apart(AgentId self, AgentId other) {
  constexpr double kGolden = 2.39996322972865332;
  const CosSin d = cos_sin_lane(kGolden * static_cast<double>((self + other) % 100'000));
  const double side = self < other ? 1.0 : -1.0;
  return {side * d.cos, side * d.sin};
}

Eigen::Vector2d with_length_up_to(const Eigen::Vector2d& v, double most) {
  const double length = std::sqrt(v.squaredNorm());
  return length > most ? Eigen::Vector2d(v * (most / length)) : v;
}

}  // namespace

/// Collects the bounds on one agent, and the agents that press it.
class Meeting {
 public:
  Meeting(const AvoidSettings& settings, const Eigen::Vector2d& wish)
      : settings_(&settings), wish_(wish), fast_(std::sqrt(wish.squaredNorm())) {}

  double fast() const { return fast_; }
  /// No velocity is larger.
  double fastest() const {
    return std::max(settings_->separate_m_s, std::sqrt(wish_.squaredNorm()) + strongest_);
  }
  double least_gap() const { return least_gap_; }

  /// @param limit  of the velocity along n; below zero it has to step back
  void meet(const Eigen::Vector2d& n, double gap, double limit) {
    least_gap_ = std::min(least_gap_, gap);
    if (gap < 0.0) {
      out_ += (gap - kClear) * n;
      inside_ = true;
      return;
    }
    bounds_.add({n, std::max(limit, 0.0)});
    if (limit >= 0.0) return;
    retreats_ = true;
    const double back = limit - wish_.dot(n);
    if (back < 0.0) wish_ += back * n;
  }

  /// Somebody that it touches.
  void feel(const Eigen::Vector2d& n, const Eigen::Vector2d& wish, int pressed) {
    const double push = -wish.dot(n);
    if (push > kIdle * fast_) {
      pushed_ -= push * n;
      strongest_ = std::max(strongest_, push);
    }
    if (pressed <= 1 || pressed < pressed_ + 1) return;
    if (pressed > pressed_ + 1) aside_.setZero();
    pressed_ = pressed - 1;
    aside_ -= n;
  }

  /// An agent that it nearly touches: they may want to go through each other.
  /// @param first  where only one of them can go on, it is this one
  void face(const Eigen::Vector2d& n, double gap, const Eigen::Vector2d& wish, bool first) {
    const double onward =
        std::min(wish_.dot(n), -wish.dot(n)) * (1.0 - std::max(gap, 0.0) / kTouch);
    if (onward <= blocked_) return;
    blocked_ = onward;
    facing_ = n;
    goes_first_ = first;
  }

  /// Agents inside of others go out; those that touch them make room, and so on outwards; all
  /// others do as they wish.
  Eigen::Vector2d velocity(Crowd::Contacts& found) {
    found.least_gap_m = std::min(found.least_gap_m, least_gap_);
    found.overlapping += inside_ ? 1 : 0;
    Eigen::Vector2d v = wish_ + with_length_up_to(pushed_, strongest_);
    if (inside_) {
      v = with_length_up_to(out_ / settings_->headway_s, settings_->separate_m_s);
    } else if (pressed_ > 0 && !retreats_) {
      v = with_length_up_to(1e3 * aside_, settings_->separate_m_s);
    }
    const bool walks = !inside_ && !retreats_ && pressed_ == 0;
    const Eigen::Vector2d within = walks && blocked_ > 0.0 ? past(v) : bounds_.nearest(v);
    found.held += within != v ? 1 : 0;
    return within;
  }
  /// Its velocity is a step back for another, until there is room for both.
  bool gives_way() const { return gives_way_; }
  int pressed() const { return inside_ || retreats_ ? AgentState::kMostPressed : pressed_; }

 private:
  /// Steering may balance between obstacles with two agents face to face, whose bounds hold both.
  /// Such an agent steps to its right, round the other; without room for that, one of them steps
  /// back until there is.
  Eigen::Vector2d past(const Eigen::Vector2d& wish) {
    const Eigen::Vector2d right(facing_.y(), -facing_.x()), held = bounds_.nearest(wish);
    const double fast = std::sqrt(wish.squaredNorm());
    const double still = 1.0 - std::sqrt(held.squaredNorm()) / (kStill * fast);
    if (!(still > 0.0)) return held;  // or no motion is wished
    const double side = still * std::min(blocked_, settings_->separate_m_s);
    const Eigen::Vector2d within = bounds_.nearest(with_length_up_to(wish + side * right, fast));
    if (goes_first_ || within.dot(right) > kAside * side) return within;
    gives_way_ = true;
    return bounds_.nearest(-side * facing_);
  }

  const AvoidSettings* settings_;
  Eigen::Vector2d wish_;
  double fast_;
  Bounds bounds_;
  double least_gap_ = std::numeric_limits<double>::infinity();
  bool inside_ = false, retreats_ = false;
  Eigen::Vector2d out_ = Eigen::Vector2d::Zero(), pushed_ = out_, aside_ = out_;
  double strongest_ = 0.0;
  double blocked_ = 0.0;  // speed of the agent towards the one that faces it most
  Eigen::Vector2d facing_ = Eigen::Vector2d::Zero();
  bool goes_first_ = false;
  bool gives_way_ = false;
  int pressed_ = 0;
};

namespace {

Cell moved(Cell c, int by) { return {c.x + by, c.y + by}; }

/// Agents [from, to) of the grid.
struct Range {
  int from, to;
};

MIMESIS_PART void copy_block(const Grid& grid, int from, const Eigen::Vector2d& origin,
                             Surroundings& to) {
  const double *x = grid.x.data() + from, *y = grid.y.data() + from;
  const float *vx = grid.vx.data() + from, *vy = grid.vy.data() + from;
  const double ox = origin.x(), oy = origin.y();
  float* __restrict tx = to.x + to.count;
  float* __restrict ty = to.y + to.count;
  float* __restrict tvx = to.vx + to.count;
  float* __restrict tvy = to.vy + to.count;
  for (int l = 0; l < Surroundings::kBlock; ++l) tx[l] = static_cast<float>(x[l] - ox);
  for (int l = 0; l < Surroundings::kBlock; ++l) ty[l] = static_cast<float>(y[l] - oy);
  for (int l = 0; l < Surroundings::kBlock; ++l) tvx[l] = vx[l];
  for (int l = 0; l < Surroundings::kBlock; ++l) tvy[l] = vy[l];
}

MIMESIS_PART void copy_block(const Grid& grid, int from, const Eigen::Vector2d& origin,
                             Candidates& to) {
  copy_block(grid, from, origin, static_cast<Surroundings&>(to));
  const float* radius = grid.radius.data() + from;
  const std::uint8_t* yields = grid.yields.data() + from;
  float* __restrict tr = to.radius + to.count;
  int* __restrict ty = to.yields + to.count;
  int* __restrict at = to.at + to.count;
  for (int l = 0; l < Surroundings::kBlock; ++l) tr[l] = radius[l];
  for (int l = 0; l < Surroundings::kBlock; ++l) ty[l] = yields[l];
  for (int l = 0; l < Surroundings::kBlock; ++l) at[l] = from + l;
}

/// Copies ranges, in blocks: what a block has too much, the next one overwrites.
template <class To>
MIMESIS_PART void copy_ranges(const Grid& grid, std::span<const Range> ranges,
                              const Eigen::Vector2d& origin, To& to) {
  to.count = 0;
  for (const Range& range : ranges) {
    int from = range.from;
    for (; from + Surroundings::kBlock < range.to; from += Surroundings::kBlock) {
      copy_block(grid, from, origin, to);
      to.count += Surroundings::kBlock;
    }
    copy_block(grid, from, origin, to);
    to.count += range.to - from;
  }
}

MIMESIS_VECTOR_CLONES
void copy(const Grid& grid, std::span<const Range> ranges, const Eigen::Vector2d& origin,
          Surroundings& to) {
  copy_ranges(grid, ranges, origin, to);
}
MIMESIS_VECTOR_CLONES
void copy(const Grid& grid, std::span<const Range> ranges, const Eigen::Vector2d& origin,
          Candidates& to) {
  copy_ranges(grid, ranges, origin, to);
}

/// Copies the agents in the cells from low to high, as many as have room at a time, and calls f.
template <class To, class F>
void for_each_batch(const Grid& grid, Cell low, Cell high, const Eigen::Vector2d& origin, To& to,
                    F&& f) {
  std::array<Range, 64> ranges;
  std::size_t count = 0;
  int total = 0;
  const auto flush = [&] {
    copy(grid, {ranges.data(), count}, origin, to);
    f();
    count = 0;
    total = 0;
  };
  grid.for_each_range(low, high, [&](int from, int end) {
    while (from < end) {
      const int some = std::min(end - from, Surroundings::kMost - total);
      ranges[count++] = {from, from + some};
      total += some;
      from += some;
      if (total == Surroundings::kMost || count == ranges.size()) flush();
    }
  });
  if (count > 0) flush();
}

int around_with_enough(const Grid& grid, Cell here) {
  const int most = grid.cells_of_reach();
  for (int around = most / 4; around < most; ++around) {
    int count = 0;
    grid.for_each_range(moved(here, -around), moved(here, around),
                        [&](int from, int to) { count += to - from; });
    if (count >= kEnough) return around;
  }
  return most;
}

}  // namespace

Eigen::Vector2d nearest_within(const Eigen::Vector2d& wish, std::span<const Bound> bounds) {
  // The nearest point within some bounds breaks others: the one that it breaks most goes to these
  // some, and the nearest point is on its line then [Seidel 1991, linear programs one by one].
  std::array<const Bound*, Bounds::kMost> kept;
  std::size_t count = 0;
  Eigen::Vector2d v = wish;
  for (;;) {
    const Bound* worst = nullptr;
    double most = kRounding;
    for (const Bound& b : bounds) {
      const double by = b.n.dot(v) - b.limit_m_s;
      if (by > most) most = by, worst = &b;
    }
    if (worst == nullptr) return v;
    const bool found = on_line(wish, *worst, {kept.data(), count}, v);
    if (!found || count == kept.size()) return Eigen::Vector2d::Zero();
    kept[count++] = worst;
  }
}

void Bounds::add(const Bound& bound) {
  if (count_ < kMost) {
    bounds_[count_++] = bound;
    return;
  }
  Bound& loosest = *std::ranges::max_element(bounds_, {}, &Bound::limit_m_s);
  const Bound out = bound.limit_m_s < loosest.limit_m_s ? std::exchange(loosest, bound) : bound;
  speed_ = std::min(speed_, out.limit_m_s);
}

Eigen::Vector2d Bounds::nearest(const Eigen::Vector2d& wish) const {
  const Eigen::Vector2d v = nearest_within(wish, {bounds_, count_});
  const double fast = std::sqrt(v.squaredNorm());
  return fast > speed_ ? Eigen::Vector2d(v * (speed_ / fast)) : v;
}

void Crowd::Impl::steer_all(parallel::Team* team) {
  grid.build(table, avoids, settings.avoid.reach_m);
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
      const Cell here = grid.cell[first];
      const auto same = [&](std::size_t i) { return grid.cell[i] == here; };
      bool done = false;
      for (std::size_t i = begin; i < first; ++i) done = done || same(i);
      if (done) continue;
      const Eigen::Vector2d origin((static_cast<double>(here.x) + 0.5) * grid.cell_m(),
                                   (static_cast<double>(here.y) + 0.5) * grid.cell_m());
      const int around = around_with_enough(grid, here);
      for_each_batch(grid, moved(here, -around), moved(here, around), origin, near, [&] {
        near.pad();
        for (std::size_t i = first; i < end; ++i) {
          if (!is_ours(i) || !same(i)) continue;
          turn[static_cast<std::size_t>(grid.row[i])] +=
              static_cast<double>(steer(near, steered(i, origin), params));
        }
      });
      if (obstacles.empty()) continue;
      for (std::size_t i = first; i < end; ++i) {
        if (!is_ours(i) || !same(i)) continue;
        const Eigen::Vector2d p(grid.x[i], grid.y[i]);
        near.count = 0;
        obstacles.for_each_near(p, [&](const ObstacleGrid::Near& o) {
          const Eigen::Vector2d at = (o.distance_m + static_cast<double>(kObstacleDepth)) * o.n;
          if (!near.full()) near.add(at.x(), at.y(), 0.0F, 0.0F);
        });
        if (near.count == 0) continue;
        near.pad();
        turn[static_cast<std::size_t>(grid.row[i])] +=
            static_cast<double>(steer(near, steered(i, p), params));
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
  for (int i = first; i < last; ++i) part(static_cast<std::size_t>(i), found);
}

void Crowd::Impl::part(std::size_t at, Contacts& found) {
  const auto row = static_cast<std::size_t>(grid.row[at]);
  if (avoids[row] == 0) return;
  Eigen::Vector2d v(wish_x[row], wish_y[row]);
  if (table.role[row] == Role::own) {
    const Eigen::Vector2d wish = v;
    const double held = static_cast<double>(table.held[row]);
    const double round = kRound_rad[way_round(held) % kRound_rad.size()];
    if (round != 0.0) {
      const CosSin c = cos_sin_lane(round);
      v = Eigen::Vector2d(c.cos * v.x() + c.sin * v.y(), c.cos * v.y() - c.sin * v.x());
    }
    bool gives_way = false;
    v = parted(at, v, found, gives_way);
    Eigen::Vector2d onward = wish;
    if (seeks[row] != 0) {
      const Eigen::Vector2d way(table.goal_x[row] - grid.x[at], table.goal_y[row] - grid.y[at]);
      onward = wish.norm() / std::max(way.norm(), 1e-9) * way;
    }
    const bool on = gives_way || v.dot(onward) >= kOnward * wish.squaredNorm();
    table.held[row] = static_cast<float>(held_after(held, on, settings.dt_s));
    table.vx[row] = static_cast<float>(v.x());
    table.vy[row] = static_cast<float>(v.y());
  }
  table.x[row] = grid.x[at] + settings.dt_s * v.x();
  table.y[row] = grid.y[at] + settings.dt_s * v.y();
}

Eigen::Vector2d Crowd::Impl::parted(std::size_t at, const Eigen::Vector2d& wish, Contacts& found,
                                    bool& gives_way) {
  const double fast = std::max(std::sqrt(wish.squaredNorm()), settings.avoid.separate_m_s);
  Meeting meeting = met(at, wish, fast);
  const double faster = meeting.fastest();  // others may push it
  if (faster > fast) meeting = met(at, wish, faster);
  table.pressed[static_cast<std::size_t>(grid.row[at])] =
      static_cast<std::uint8_t>(meeting.pressed());
  const Eigen::Vector2d v = meeting.velocity(found);
  gives_way = meeting.gives_way();
  return v;
}

namespace {

/// An agent that others may bound, at the origin of its candidates.
struct Reach {
  float ux, uy, radius, headway_s, fastest, range;
};

/// Bounds of all candidates; `chosen` are those that the agent has to heed. At the same point there
/// is no direction: that is left to the caller.
MIMESIS_VECTOR_CLONES
void bound(Candidates& c, const Reach& a) {
  const float ux = a.ux, uy = a.uy, own = a.radius, fastest = a.fastest;
  const float per = 1.0F / a.headway_s, range2 = a.range * a.range;
  constexpr float kSkinF = static_cast<float>(kSkin), kTouchF = static_cast<float>(kTouch);
  const int end =
      (c.count + Surroundings::kBlock - 1) / Surroundings::kBlock * Surroundings::kBlock;
  const float* __restrict x = c.x, * __restrict y = c.y, * __restrict vx = c.vx, * __restrict vy = c.vy;
  const float* __restrict radius = c.radius;
  const int* __restrict yields = c.yields;
  float* __restrict nx = c.nx, * __restrict ny = c.ny, * __restrict gap = c.gap, * __restrict limit = c.limit;
  int* __restrict heeded = c.heeded;
  for (int base = 0; base < end; base += Surroundings::kBlock) {
    for (int k = base; k < base + Surroundings::kBlock; ++k) {
      const float d2 = x[k] * x[k] + y[k] * y[k];
      const float d = std::sqrt(d2), per_d = 1.0F / (d > 1e-9F ? d : 1e-9F);
      const float to_x = x[k] * per_d, to_y = y[k] * per_d;
      const float room = d - (own + radius[k]);
      const float along = vx[k] * to_x + vy[k] * to_y;
      const float own_along = ux * to_x + uy * to_y, mean = 0.5F * (own_along + along);
      const float open = room - kSkinF > 0.0F ? (room - kSkinF) * per : 0.0F;
      const float h = 0.5F * open, below = mean < h ? mean : h;
      const float shared = h + (below > -h ? below : -h), lone = open + along;
      const float most = yields[k] != 0 ? shared : lone;
      nx[k] = to_x;
      ny[k] = to_y;
      gap[k] = room;
      limit[k] = most;
      heeded[k] =
          (((most < fastest) | (room <= kTouchF) | (own_along - along > open)) & (d2 <= range2))
              ? 1
              : 0;
    }
  }
  int chosen = 0;
  for (int k = 0; k < c.count; ++k) {
    c.chosen[chosen] = k;
    chosen += heeded[k];
  }
  c.heed = chosen;
}

}  // namespace

std::optional<Bound> step_end_bound(const Pair& p, double headway_s, double dt_s) {
  const Eigen::Vector2d w = p.own_m_s - p.other_m_s, across(-p.n.y(), p.n.x());
  const double open = std::max(p.gap_m - kSkin, 0.0) / headway_s, closing = w.dot(p.n);
  const double spare = open * dt_s / p.distance_m, least = 1.0 - spare;  // cosine
  if (closing <= open || spare >= 1.0) return std::nullopt;
  const Eigen::Vector2d end(p.distance_m - dt_s * closing, -dt_s * w.dot(across));
  const double length = std::sqrt(end.squaredNorm());
  double cosine = least, sine = std::copysign(std::sqrt(spare * (1.0 + least)), end.y());
  if (end.x() > least * length) cosine = end.x() / length, sine = end.y() / length;
  const Eigen::Vector2d n = cosine * p.n + sine * across;
  const double left = open - p.distance_m / dt_s * sine * sine / (1.0 + cosine);
  const double h = 0.5 * std::max(left, 0.0);
  return Bound{n, h + std::clamp(0.5 * (p.own_m_s + p.other_m_s).dot(n), -h, h)};
}

/// All that bound an agent which goes no faster than this; limits above that bound nothing.
Meeting Crowd::Impl::met(std::size_t at, const Eigen::Vector2d& wish, double fastest) const {
  const AvoidSettings& s = settings.avoid;
  const auto row = static_cast<std::size_t>(grid.row[at]);
  const Eigen::Vector2d p(grid.x[at], grid.y[at]);
  const Eigen::Vector2d u(static_cast<double>(grid.vx[at]), static_cast<double>(grid.vy[at]));
  const double radius = static_cast<double>(grid.radius[at]);
  Meeting meeting(s, wish);
  // Limits of who yields are gap/(2 headway) + (u + v)·n/2 or more, of others gap/headway + v·n.
  const double range = std::min(
      s.reach_m, radius + grid.largest_radius() + kSkin +
                     s.headway_s * (2.0 * fastest + std::sqrt(u.squaredNorm()) + grid.fastest()));
  const Reach reach{grid.vx[at],
                    grid.vy[at],
                    grid.radius[at],
                    static_cast<float>(s.headway_s),
                    static_cast<float>(fastest),
                    static_cast<float>(range)};
  Candidates near;
  for_each_batch(
      grid, grid.cell_at(p.x() - range, p.y() - range), grid.cell_at(p.x() + range, p.y() + range),
      p, near, [&] {
        bound(near, reach);
        for (int chosen = 0; chosen < near.heed; ++chosen) {
          const int k = near.chosen[chosen];
          const auto j = static_cast<std::size_t>(near.at[k]);
          if (j == at) continue;
          const auto other = static_cast<std::size_t>(grid.row[j]);
          Eigen::Vector2d n(static_cast<double>(near.nx[k]), static_cast<double>(near.ny[k]));
          const double gap = static_cast<double>(near.gap[k]);
          double limit = static_cast<double>(near.limit[k]);
          if (near.x[k] == 0.0F && near.y[k] == 0.0F) {
            n = apart(table.id[row], table.id[other]);
            limit = 0.0;
          } else if (near.yields[k] != 0) {
            const Eigen::Vector2d v(static_cast<double>(near.vx[k]),
                                    static_cast<double>(near.vy[k]));
            const double d = gap + radius + static_cast<double>(near.radius[k]);
            if (const auto b = step_end_bound({n, d, gap, u, v}, s.headway_s, settings.dt_s)) {
              n = b->n;
              limit = b->limit_m_s;
            }
          }
          meeting.meet(n, gap, limit);
          if (gap > kTouch || avoids[other] == 0) continue;
          const Eigen::Vector2d its(wish_x[other], wish_y[other]);
          const bool first = table.id[row] < table.id[other];
          if (table.role[other] == Role::own) {
            meeting.face(n, gap, its, first);
          }
          meeting.feel(n, its, grid.pressed[j]);
        }
      });
  obstacles.for_each_near(p, [&](const ObstacleGrid::Near& o) {
    const double gap = o.distance_m - radius;
    meeting.meet(o.n, gap, lone_limit(gap - kSkin, s.headway_s, 0.0));
  });
  return meeting;
}

}  // namespace mimesis::crowd
