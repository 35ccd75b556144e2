#include "nodes/planner/part_checker.h"

#include <algorithm>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "nodes/planner/collision.h"

namespace mimesis::planner {
namespace {

constexpr double kRounding = 1e-5;  // [m]
constexpr double kNoLimit = std::numeric_limits<double>::infinity();

math::ConvexPart box_part(const kin::Box& box) {
  math::ConvexPart part{Eigen::MatrixX3d(8, 3)};
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d sign(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1);
    part.points.row(i) = (box.center + sign.cwiseProduct(box.half_extent)).transpose();
  }
  return part;
}

kin::SafetyPart ball_part(int frame, int group, const Eigen::Vector3d& center, double radius) {
  return {frame, group, {center.transpose(), radius}, {{center, radius}}};
}

/// Balls held by one around the box of their centres.
math::RoundBound around(const std::vector<math::RoundBound>& balls) {
  Eigen::AlignedBox3d box;
  for (const math::RoundBound& ball : balls) box.extend(ball.center);
  math::RoundBound out{box.center(), 0.0};
  for (const math::RoundBound& ball : balls)
    out.radius = std::max(out.radius, (ball.center - out.center).norm() + ball.radius);
  return out;
}

Eigen::ArrayX4d rows(const std::vector<math::RoundBound>& balls) {
  Eigen::ArrayX4d out(std::ssize(balls), 4);
  for (Eigen::Index i = 0; i < out.rows(); ++i) {
    const math::RoundBound& ball = balls[static_cast<std::size_t>(i)];
    out.row(i) << ball.center.x(), ball.center.y(), ball.center.z(), ball.radius;
  }
  return out;
}

}  // namespace

PartChecker::PartChecker(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m)
    : arm_(arm), margin_(margin_m + kRounding) {
  int hand = arm.balls.empty() ? 0 : arm.balls.back().group;
  for (const kin::SafetyBall& ball : arm.balls)
    if (ball.frame == arm.dof()) hand = ball.group;
  for (kin::SafetyPart& part : kin::deciding_parts(arm)) {
    const bool is_ball = part.shape.points.rows() == 1;
    const std::string& group = arm.groups[static_cast<std::size_t>(part.group)];
    std::string name =
        (is_ball ? "ball " : "part ") + std::to_string(parts_.size()) + " (" + group + ")";
    const Body body{part.frame, part.group};
    add(std::move(part), std::move(name), body);
  }
  for (const kin::Ball& ball : obstacles.held)
    add(ball_part(arm.dof(), hand, arm.X_LE * ball.center, ball.radius), "the held object",
        {arm.dof(), hand, true});
  const std::size_t moving_parts = parts_.size(), moving_bodies = bodies_.size();
  add_obstacles(obstacles);
  for (Part& part : parts_) part.cover = rows(part.shape.cover);
  for (Body& body : bodies_) {
    std::vector<math::RoundBound> all;
    for (const std::size_t part : body.parts) {
      const std::vector<math::RoundBound>& cover = parts_[part].shape.cover;
      all.insert(all.end(), cover.begin(), cover.end());
    }
    body.cover = rows(all);
    body.around = around(all);
    body.around_cover = rows({body.around});
    // From the body inwards: its farthest point from the origin of a frame, then from the axis.
    double reach = body.around.center.norm() + body.around.radius;
    body.lever_m.resize(static_cast<std::size_t>(body.frame));
    for (std::size_t j = body.lever_m.size(); j-- > 0;) {
      const kin::DhLink& link = arm.links[j];
      const auto joint = static_cast<Eigen::Index>(j);
      const double slide =
          link.slides ? std::max(std::abs(arm.q_min[joint]), std::abs(arm.q_max[joint])) : 0.0;
      const double longer = std::hypot(link.a, std::abs(link.d) + slide);
      body.lever_m[j] = link.slides ? 1.0 : reach + (link.modified ? 0.0 : longer);
      reach += longer;
    }
  }
  for (std::size_t a = 0; a < bodies_.size(); ++a) {
    const Body& one = bodies_[a];
    const bool faces = one.held || std::ranges::count(arm.env_groups, one.group) > 0;
    for (std::size_t b = 0; b < bodies_.size() && !one.obstacle; ++b) {
      const Body& other = bodies_[b];
      if (other.obstacle) {
        if (faces && !(one.held && other.support)) pairs_.push_back(Pair{b, a});
      } else if (std::ranges::count(arm.self_pairs, std::pair(one.group, other.group)) > 0) {
        pairs_.push_back(one.frame <= other.frame ? Pair{a, b} : Pair{b, a});
      }
    }
  }
  for (const kin::SafetyLink& link : arm.part_links) {
    const auto all_of = [&](const Body& body) {
      return body.parts.size() > 1 && body.parts.front() == link.begin &&
             body.parts.size() == link.end - link.begin;
    };
    const auto body = std::ranges::find_if(bodies_, all_of);
    if (body != bodies_.end()) body->hull = &link.hull;
  }
  order_.resize(pairs_.size());
  std::iota(order_.begin(), order_.end(), 0u);
  for (const Body& body : bodies_) centers_.push_back(body.around.center);
  most_motion_.resize(moving_bodies);
  motion_.resize(moving_parts);
  body_motion_.resize(moving_bodies);
  around_motion_.resize(moving_bodies);
  axes_.resize(arm.links.size() + 1);
  frames_.assign(arm.links.size() + 1, arm.X_WB);
  for (const kin::DhLink& link : arm.links)
    around_joint_.push_back(link.modified ? link.before_joint() : link.after_joint());
  origins_.resize(arm.links.size());
  directions_.resize(arm.links.size());
}

void PartChecker::add_obstacles(const Obstacles& obstacles) {
  constexpr std::size_t kMostBalls = 16;  // of a body
  Body body{.frame = 0, .group = -1, .obstacle = true};
  Eigen::Matrix3Xd centers(3, std::ssize(obstacles.balls));
  for (Eigen::Index i = 0; i < centers.cols(); ++i)
    centers.col(i) = obstacles.balls[static_cast<std::size_t>(i)].center;
  for (const std::vector<std::size_t>& near : near_each_other(centers, kMostBalls)) {
    ++body.number;
    for (const std::size_t i : near) {
      const kin::Ball& ball = obstacles.balls[i];
      add(ball_part(0, -1, ball.center, ball.radius), "the obstacle ball at " + in_mm(ball.center),
          body);
    }
  }
  for (const kin::Hull& hull : obstacles.hulls) {
    ++body.number;
    add({0, -1, hull.shape, hull.cover}, "the " + hull.name, body);
  }
  for (const bool support : {false, true}) {
    body.support = support;
    for (const kin::Box& box : support ? obstacles.supports : obstacles.boxes) {
      ++body.number;
      const math::ConvexPart part = box_part(box);
      add({0, -1, part, {math::round_bound(part)}}, in_words(box), body);
    }
  }
}

void PartChecker::add(kin::SafetyPart shape, std::string name, Body body) {
  const auto same = [&body](const Body& other) {
    return body.obstacle == other.obstacle && body.frame == other.frame &&
           body.group == other.group && body.held == other.held && body.number == other.number;
  };
  // Those of an obstacle follow each other.
  auto known = body.obstacle && !bodies_.empty() ? bodies_.end() - 1 : bodies_.begin();
  known = std::find_if(known, bodies_.end(), same);
  if (known == bodies_.end()) known = bodies_.insert(known, std::move(body));
  known->parts.push_back(parts_.size());
  const math::RoundBound whole = around(shape.cover);
  parts_.push_back({std::move(shape), std::move(name), whole});
}

/// Frame j + 1, and axis j.
void PartChecker::place_next(std::size_t j, double q) {
  const kin::DhLink& link = arm_.links[j];
  const auto times = [](const Eigen::Isometry3d& a, const Eigen::Isometry3d& b) {
    Eigen::Isometry3d product;
    product.linear() = a.linear().lazyProduct(b.linear());
    product.translation() = a.linear().lazyProduct(b.translation()) + a.translation();
    return product;
  };
  Eigen::Isometry3d axis = link.modified ? times(frames_[j], around_joint_[j]) : frames_[j];
  const Eigen::Vector3d x = axis.linear().col(0), y = axis.linear().col(1);
  origins_[j] = axis.translation();
  directions_[j] = axis.linear().col(2);
  if (link.slides) {
    axis.translation() += q * directions_[j];
  } else {
    const double c = std::cos(q + link.offset), s = std::sin(q + link.offset);
    axis.linear().col(0) = c * x + s * y;
    axis.linear().col(1) = c * y - s * x;
  }
  frames_[j + 1] = link.modified ? axis : times(axis, around_joint_[j]);
}

void PartChecker::place(const Eigen::Ref<const Eigen::VectorXd>& q) {
  still_ = deviation_.isZero(0.0);
  for (std::size_t j = 0; j < origins_.size(); ++j) place_next(j, q[static_cast<Eigen::Index>(j)]);
  for (std::size_t i = 0; i < most_motion_.size(); ++i) {
    const Body& body = bodies_[i];
    centers_[i] = frames_[static_cast<std::size_t>(body.frame)] * body.around.center;
    most_motion_[i] = 0.0;
    for (std::size_t j = 0; j < body.lever_m.size(); ++j)
      most_motion_[i] += body.lever_m[j] * deviation_[static_cast<Eigen::Index>(j)];
  }
  for (auto* all : {&motion_, &body_motion_, &around_motion_})
    for (std::vector<double>& known : *all) known.clear();
  for (std::vector<Axis>& axes : axes_) axes.clear();
}

/// D of BatchChecker::judge_motions, of balls in one frame.
double PartChecker::motion(const Cover& cover, std::vector<double>& known, std::size_t frame,
                           std::size_t relative_to) {
  if (still_) return 0.0;
  if (!known.empty()) return known[relative_to];
  known.assign(frame + 1, 0.0);  // first how far they reach from the axes
  std::vector<Axis>& axes = axes_[frame];
  if (axes.empty()) {
    const Eigen::Isometry3d X_FW = frames_[frame].inverse(Eigen::Isometry);
    for (std::size_t j = 0; j < frame; ++j)
      axes.push_back({X_FW * origins_[j], X_FW.linear() * directions_[j]});
  }
  for (std::size_t j = 0; j < frame; ++j) {
    const auto& [o, d] = axes[j];
    const auto x = cover.col(0) - o.x(), y = cover.col(1) - o.y(), z = cover.col(2) - o.z();
    // |v x d|^2 by its components: |v|^2 - (v d)^2 would cancel near the axis.
    const auto off_axis = (y * d.z() - z * d.y()).square() + (z * d.x() - x * d.z()).square() +
                          (x * d.y() - y * d.x()).square();
    known[j] = (off_axis.sqrt() + cover.col(3)).maxCoeff();
  }
  double moved = 0.0;
  for (std::size_t j = frame; j-- > 0;) {
    const double reach = arm_.links[j].slides ? 1.0 - moved : known[j];
    known[j] = moved += (reach + moved) * deviation_[static_cast<Eigen::Index>(j)];
  }
  return known[relative_to];
}

/// Beyond the margin, by the balls around two bodies.
double PartChecker::apart(const Pair& pair) const {
  return (centers_[pair.inner] - centers_[pair.outer]).norm() - bodies_[pair.inner].around.radius -
         bodies_[pair.outer].around.radius - margin_;
}

Eigen::Isometry3d PartChecker::between(const Body& inner, const Body& outer) const {
  const Eigen::Isometry3d& X_WO = frames_[static_cast<std::size_t>(outer.frame)];
  if (inner.obstacle) return X_WO;
  const Eigen::Isometry3d& X_WI = frames_[static_cast<std::size_t>(inner.frame)];
  return X_WI.inverse(Eigen::Isometry) * X_WO;
}

PartChecker::Verdict PartChecker::judge(const Eigen::Ref<const Eigen::VectorXd>& q,
                                        const Eigen::Ref<const Eigen::VectorXd>& deviation,
                                        std::span<const Near> only, std::vector<Near>* near,
                                        bool often) {
  constexpr int kMostCells = 256;  // judged for one pair
  deviation_ = deviation.cwiseAbs();
  place(q);
  near_.clear();
  const auto touch = [&](std::uint32_t number, std::span<const Near> some) {
    const Pair& pair = pairs_[number];
    if (apart(pair) >= most_motion_[pair.outer]) return false;
    const bool known = often && free_by_cells(number, q, deviation, 0);
    return !known && touches(number, some, near_);
  };
  for (auto number = order_.begin(); only.empty() && number != order_.end(); ++number) {
    if (!touch(*number, {})) continue;
    std::rotate(order_.begin(), number, number + 1);
    return Verdict::touches;
  }
  while (!only.empty()) {
    const auto of_pair =
        std::ranges::find_if(only, [&](const Near& one) { return one.pair != only.front().pair; });
    const auto some = only.first(static_cast<std::size_t>(of_pair - only.begin()));
    if (touch(only.front().pair, some)) return Verdict::touches;
    only = only.subspan(some.size());
  }
  for (std::size_t i = 0; often && i < near_.size();) {
    const std::uint32_t number = near_[i].pair;
    const auto of_pair = [number](const Near& one) { return one.pair == number; };
    if (free_by_cells(number, q, deviation, kMostCells)) {
      std::erase_if(near_, of_pair);
    } else {
      while (i < near_.size() && of_pair(near_[i])) ++i;
    }
  }
  if (near != nullptr) near->insert(near->end(), near_.begin(), near_.end());
  return near_.empty() ? Verdict::free : Verdict::near;
}

/// Whether the motions of the joints between a pair's links are proven free by its cells.
/// @param most  cells that may be judged for this
bool PartChecker::free_by_cells(std::uint32_t number, const Eigen::Ref<const Eigen::VectorXd>& q,
                                const Eigen::Ref<const Eigen::VectorXd>& deviation, int most) {
  constexpr std::size_t kMostInAll = 50'000;  // of a pair
  Pair& pair = pairs_[number];
  const Eigen::Index first = bodies_[pair.inner].frame, n = bodies_[pair.outer].frame - first;
  if (n < 1 || n > kCellJoints || (pair.cells.empty() && most == 0)) return false;
  if (pair.cells.empty()) {
    constexpr double kStops = 0.5;  // how far they may lead beyond the limits [rad]
    Cell all{Corner::Zero(), Corner::Zero()};
    all.lo.head(n) = arm_.q_min.segment(first, n).array() - kStops;
    all.hi.head(n) = arm_.q_max.segment(first, n).array() + kStops;
    pair.cells.push_back(std::move(all));
  }
  Corner lo = Corner::Zero(), hi = Corner::Zero();
  lo.head(n) = q.segment(first, n).array() - deviation.segment(first, n).array().abs();
  hi.head(n) = q.segment(first, n).array() + deviation.segment(first, n).array().abs();
  if ((lo < pair.cells[0].lo).any() || (hi > pair.cells[0].hi).any()) return false;
  for (open_cells_.assign(1, 0); !open_cells_.empty();) {
    const std::size_t i = open_cells_.back();
    open_cells_.pop_back();
    if ((lo > pair.cells[i].hi).any() || (hi < pair.cells[i].lo).any()) continue;
    if (pair.cells[i].is == Cell::Is::open) {
      if (most-- <= 0 || pair.cells.size() > kMostInAll) return false;
      judge_cell(number, i);
    }
    Cell& cell = pair.cells[i];
    if (cell.is == Cell::Is::near) return false;
    if (cell.is != Cell::Is::halved) continue;
    const auto is_free = [&](std::size_t k) { return pair.cells[k].is == Cell::Is::free; };
    if (is_free(cell.halves) && is_free(cell.halves + 1)) {
      cell.is = Cell::Is::free;
    } else {
      open_cells_.insert(open_cells_.end(), {cell.halves, cell.halves + 1});
    }
  }
  return true;
}

void PartChecker::judge_cell(std::uint32_t number, std::size_t index) {
  constexpr double kLeast_m = 1e-3;  // motion of the farthest point in a cell that is not halved
  std::vector<Cell>& cells = pairs_[number].cells;
  const Body& outer = bodies_[pairs_[number].outer];
  const Eigen::Index first = bodies_[pairs_[number].inner].frame, n = outer.frame - first;
  Cell& cell = cells[index];
  Eigen::VectorXd q = Eigen::VectorXd::Zero(arm_.dof());
  deviation_ = q;
  q.segment(first, n) = 0.5 * (cell.lo + cell.hi).head(n);
  deviation_.segment(first, n) = 0.5 * (cell.hi - cell.lo).head(n);
  place(q);
  near_in_cell_.clear();
  const bool touch = touches(number, cell.near, near_in_cell_);
  const std::vector<Near> near = touch ? std::move(cell.near) : near_in_cell_;
  cell.near.clear();
  Eigen::Index widest = 0;
  const auto levers = Eigen::VectorXd::Map(outer.lever_m.data() + first, n).array();
  const double most_m = (levers * deviation_.segment(first, n).array()).maxCoeff(&widest);
  if (!touch && near.empty()) {
    cell.is = Cell::Is::free;
  } else if (most_m < kLeast_m) {
    cell.is = Cell::Is::near;
  } else {
    cell.is = Cell::Is::halved;
    cell.halves = cells.size();
    Cell low{cell.lo, cell.hi, Cell::Is::open, 0, near}, high = low;
    low.hi[widest] = high.lo[widest] = q[first + widest];
    cells.push_back(std::move(low));
    cells.push_back(std::move(high));
  }
}

/// Whether the posture touches; what may touch during the motion is added to `near`.
/// @param only  of this pair; empty: all of it
bool PartChecker::touches(std::uint32_t number, std::span<const Near> only,
                          std::vector<Near>& near) {
  Pair& pair = pairs_[number];
  const std::size_t o = pair.outer;
  const Body &inner = bodies_[pair.inner], &outer = bodies_[o];
  const double apart = this->apart(pair);
  if (apart >= most_motion_[o]) return false;
  const auto frame = static_cast<std::size_t>(outer.frame),
             below = static_cast<std::size_t>(inner.frame);
  if (apart >= motion(outer.around_cover, around_motion_[o], frame, below)) return false;
  double all_moved = kNoLimit;
  const Eigen::Isometry3d X_IO = between(inner, outer);
  if (only.empty()) {
    all_moved = motion(outer.cover, body_motion_[o], frame, below);
    if (apart >= all_moved) return false;
    if (inner.hull != nullptr || outer.hull != nullptr) {
      const auto hull_of = [this](const Body& body) -> const math::ConvexPart* {
        return body.hull != nullptr    ? body.hull
               : body.parts.size() > 1 ? nullptr
                                       : &parts_[body.parts.front()].shape.shape;
      };
      const math::ConvexPart *a = hull_of(inner), *b = hull_of(outer);
      const double far = margin_ + all_moved;
      if (a != nullptr && b != nullptr &&
          math::gap_between(*a, *b, X_IO, -kNoLimit, far, pair.apart).at_least >= far)
        return false;
    }
  }
  const std::size_t of_inner = inner.parts.size(), count = of_inner * outer.parts.size();
  if (pair.parts_apart.empty()) pair.parts_apart.assign(count, Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < (only.empty() ? count : only.size()); ++i) {
    const std::size_t index = only.empty() ? (pair.touched + i) % count : only[i].parts;
    const std::size_t a = inner.parts[index % of_inner], b = outer.parts[index / of_inner];
    const math::RoundBound &round_a = parts_[a].around, &round_b = parts_[b].around;
    const double rough =
        (X_IO * round_b.center - round_a.center).norm() - round_a.radius - round_b.radius - margin_;
    if (rough >= all_moved) continue;
    const double moved = motion(parts_[b].cover, motion_[b], frame, below);
    if (rough >= moved) continue;
    const double far = margin_ + moved;
    const math::Gap gap = math::gap_between(parts_[a].shape.shape, parts_[b].shape.shape, X_IO,
                                            margin_, far, pair.parts_apart[index]);
    if (gap.at_most < margin_) {
      pair.touched = index;
      return true;
    }
    if (gap.at_least < far) near.push_back({number, static_cast<std::uint32_t>(index)});
  }
  return false;
}

std::string PartChecker::nearest(const Eigen::Ref<const Eigen::VectorXd>& q) {
  deviation_ = Eigen::VectorXd::Zero(q.size());
  place(q);
  double least = std::numeric_limits<double>::infinity();
  std::string words;
  for (const Pair& pair : pairs_) {
    const Body &inner = bodies_[pair.inner], &outer = bodies_[pair.outer];
    const auto far = [&least](const Eigen::Vector3d& between, const math::RoundBound& a,
                              const math::RoundBound& b) {
      return between.norm() - a.radius - b.radius >= least + kRounding;
    };
    if (far(centers_[pair.inner] - centers_[pair.outer], inner.around, outer.around)) continue;
    const Eigen::Isometry3d X_IO = between(inner, outer);
    for (const std::size_t a : inner.parts) {
      for (const std::size_t b : outer.parts) {
        const math::RoundBound &round_a = parts_[a].around, &round_b = parts_[b].around;
        if (far(X_IO * round_b.center - round_a.center, round_a, round_b)) continue;
        const double gap =
            math::gap_between(parts_[a].shape.shape, parts_[b].shape.shape, X_IO).at_most;
        if (gap >= least) continue;
        least = gap;
        words = parts_[b].name + " touches " + parts_[a].name;
      }
    }
  }
  return words;
}

std::string PartChecker::torn(const Eigen::Ref<const Eigen::VectorXd>& a,
                              const Eigen::Ref<const Eigen::VectorXd>& b,
                              const Interrupt& interrupt) {
  constexpr double kStep = 0.03;  // [rad]
  constexpr int kAround = 2;      // steps around both ends in which all counts as free
  using Place = std::array<int, 2>;
  deviation_ = Eigen::VectorXd::Zero(arm_.dof());
  for (std::uint32_t number = 0; number < pairs_.size(); ++number) {
    const Body &inner = bodies_[pairs_[number].inner], &outer = bodies_[pairs_[number].outer];
    const Eigen::Index first = inner.frame, n = outer.frame - first;
    const auto slides = [&](Eigen::Index j) { return arm_.links[std::size_t(j)].slides; };
    if (n < 1 || n > 2 || slides(first) || slides(first + n - 1)) continue;  // a rail may be long
    place(a);
    Place last{}, from{}, to{};
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto i = static_cast<std::size_t>(j);
      const auto place = [low = arm_.q_min[first + j]](double at) {
        return static_cast<int>((at - low) / kStep);
      };
      last[i] = place(arm_.q_max[first + j]);
      from[i] = place(a[first + j]);
      to[i] = place(b[first + j]);
    }
    const auto steps = [](const Place& one, const Place& other) {
      return std::max(std::abs(one[0] - other[0]), std::abs(one[1] - other[1]));
    };
    std::vector<char> seen(static_cast<std::size_t>((last[0] + 1) * (last[1] + 1)));
    std::priority_queue<std::pair<int, Place>> open;  // nearest to the end first
    const auto look_at = [&](const Place& at) {
      if (at[0] < 0 || at[1] < 0 || at[0] > last[0] || at[1] > last[1]) return;
      char& before = seen[static_cast<std::size_t>(at[0] * (last[1] + 1) + at[1])];
      if (std::exchange(before, 1) != 0) return;
      if (steps(at, from) > kAround && steps(at, to) > kAround) {
        for (Eigen::Index j = 0; j < n; ++j)
          place_next(static_cast<std::size_t>(first + j),
                     arm_.q_min[first + j] + kStep * (at[static_cast<std::size_t>(j)] + 0.5));
        centers_[pairs_[number].outer] =
            frames_[static_cast<std::size_t>(outer.frame)] * outer.around.center;
        if (touches(number, {}, near_)) return;
      }
      open.push({-steps(at, to), at});
    };
    bool met = false;
    for (look_at(from); !met && !open.empty();) {
      const auto [left, at] = open.top();
      open.pop();
      met = left == 0 || interrupt.now();
      for (int i = 0; i < 9; ++i) look_at({at[0] + i / 3 - 1, at[1] + i % 3 - 1});
    }
    if (met) continue;
    const auto name = [this](const Body& body) {
      return body.obstacle ? parts_[body.parts.front()].name
                           : arm_.groups[static_cast<std::size_t>(body.group)];
    };
    return name(outer) + " touches " + name(inner) + " wherever joint " +
           std::to_string(first + n) + " passes";
  }
  return {};
}

}  // namespace mimesis::planner
