#include "common/robot/cover_balls.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

#include "common/error.h"

namespace mimesis::robot {
namespace {

using Eigen::AlignedBox3d;
using Eigen::Vector3d;

/// Distance from a box around the origin, in as many dimensions as q has: q = |p| − half.
template <class Vector>
double from_box(const Vector& q) {
  return q.maxCoeff() < 0.0 ? q.maxCoeff() : q.cwiseMax(0.0).norm();
}

double signed_distance(const Solid& solid, const Vector3d& p_L) {
  const Vector3d p = solid.X_LS.inverse(Eigen::Isometry) * p_L;
  switch (solid.kind) {
    case Solid::Kind::box:
      return from_box(Vector3d(p.cwiseAbs() - solid.half_m));
    case Solid::Kind::ball:
      return p.norm() - solid.half_m.x();
    case Solid::Kind::cylinder:
      return from_box(Eigen::Vector2d(p.head<2>().norm() - solid.half_m.x(),
                                      std::abs(p.z()) - solid.half_m.z()));
    case Solid::Kind::mesh:
      break;
  }
  const double distance = solid.mesh->distance(p);
  const bool inside = solid.mesh->box().contains(p) && std::abs(solid.mesh->winding(p)) > 0.5;
  return inside ? -distance : distance;
}

AlignedBox3d box_of(std::span<const Solid> solids) {
  AlignedBox3d box;
  for (const Solid& solid : solids) {
    AlignedBox3d own(-solid.half_m, solid.half_m);
    if (solid.kind == Solid::Kind::ball)
      own = {Vector3d::Constant(-solid.half_m.x()), Vector3d::Constant(solid.half_m.x())};
    if (solid.kind == Solid::Kind::cylinder)
      own = {Vector3d(-solid.half_m.x(), -solid.half_m.x(), -solid.half_m.z()),
             Vector3d(solid.half_m.x(), solid.half_m.x(), solid.half_m.z())};
    if (solid.kind == Solid::Kind::mesh) own = solid.mesh->box();
    box.extend(own.transformed(solid.X_LS));
  }
  return box;
}

/// The point of the solids nearest to p, which is `distance` outside.
Vector3d foot(std::span<const Solid> solids, const Vector3d& p, double distance) {
  constexpr double kStep_m = 1e-7;
  Vector3d slope;
  for (int i = 0; i < 3; ++i) {
    const Vector3d by = kStep_m * Vector3d::Unit(i);
    slope[i] = signed_distance(solids, p + by) - signed_distance(solids, p - by);
  }
  return slope.norm() > 0.0 ? Vector3d(p - distance * slope.normalized()) : p;
}

struct Samples {
  std::vector<Vector3d> points;       // to be covered
  std::vector<CoverBall> candidates;  // radius: distance inside the solids; < 0: outside
};

/// On a grid: every eighth point inside, the feet on the boundary of those just outside of it, and
/// as centres those from which no neighbour is much deeper.
Samples sample(std::span<const Solid> solids) {
  constexpr double kCells = 8000.0, kSlope = 0.85;
  const AlignedBox3d box = box_of(solids);
  const Vector3d size = box.sizes().cwiseMax(1e-3 * box.sizes().maxCoeff());
  const double step = std::max(std::cbrt(size.prod() / kCells), size.maxCoeff() / 200.0);
  // odd: planes and axes of symmetry are on the grid
  const Eigen::Vector3i n = 2 * (0.5 * size / step).array().ceil().cast<int>() + 5;
  const Vector3d first = box.center() - 0.5 * step * (n.cast<double>() - Vector3d::Ones());
  const auto at = [&](int x, int y, int z) -> Vector3d { return first + step * Vector3d(x, y, z); };
  const auto index = [&](int x, int y, int z) {
    return static_cast<std::size_t>((x * n.y() + y) * n.z() + z);
  };
  std::vector<double> depth(index(n.x() - 1, n.y() - 1, n.z() - 1) + 1);
  Samples out;
  for (int x = 0; x < n.x(); ++x) {
    for (int y = 0; y < n.y(); ++y) {
      for (int z = 0; z < n.z(); ++z) {
        const Vector3d p = at(x, y, z);
        const double distance = signed_distance(solids, p);
        depth[index(x, y, z)] = -distance;
        if (distance <= 0.0 && x % 2 == 0 && y % 2 == 0 && z % 2 == 0) out.points.push_back(p);
        if (distance <= 0.0 || distance > 1.8 * step) continue;
        out.points.push_back(foot(solids, p, distance));
      }
    }
  }
  for (int x = 1; x + 1 < n.x(); ++x) {
    for (int y = 1; y + 1 < n.y(); ++y) {
      for (int z = 1; z + 1 < n.z(); ++z) {
        const double mine = depth[index(x, y, z)];
        bool central = mine > -3.0 * step;
        for (int i = 0; central && i < 27; ++i) {
          const Eigen::Vector3i by(i / 9 - 1, i / 3 % 3 - 1, i % 3 - 1);
          const double theirs = depth[index(x + by.x(), y + by.y(), z + by.z())];
          central = theirs - mine <= kSlope * step * by.cast<double>().norm();
        }
        if (central) out.candidates.push_back({at(x, y, z), mine});
      }
    }
  }
  return out;
}

/// Greedy set cover: always the candidate, with `reach` added to its radius, that covers most of
/// what is left. A point that none covers gets a ball of its own.
std::vector<CoverBall> greedy(const Samples& samples, double reach, std::size_t most) {
  std::vector<Vector3d> left = samples.points;
  const auto gain = [&](std::size_t i) {
    const CoverBall& ball = samples.candidates[i];
    const double r = ball.radius + reach;
    if (r <= 0.0) return std::ptrdiff_t{0};
    return std::ranges::count_if(
        left, [&](const Vector3d& p) { return (p - ball.center).squaredNorm() <= r * r; });
  };
  using Entry = std::pair<std::ptrdiff_t, std::size_t>;  // gain when last looked at, −index
  std::priority_queue<Entry> queue;
  const std::size_t count = samples.candidates.size();
  for (std::size_t i = 0; i < count; ++i) queue.emplace(gain(i), count - i);
  std::vector<CoverBall> balls;
  while (!left.empty() && balls.size() <= most) {
    CoverBall ball{left.front(), reach};
    while (!queue.empty()) {  // gains only fall: a fresh one above all old ones is the best
      const auto [old, back] = queue.top();
      queue.pop();
      const std::size_t i = count - back;
      const std::ptrdiff_t fresh = gain(i);
      if (fresh == 0) continue;
      if (fresh == old) {
        ball = {samples.candidates[i].center, samples.candidates[i].radius + reach};
        break;
      }
      queue.emplace(fresh, back);
    }
    std::erase_if(left, [&](const Vector3d& p) {
      return (p - ball.center).squaredNorm() <= ball.radius * ball.radius;
    });
    balls.push_back(ball);
  }
  return balls;
}

/// The smallest ball around points, nearly: the centre goes towards the farthest one by ever
/// smaller steps (Bădoiu and Clarkson 2003).
CoverBall around(const std::vector<Vector3d>& points, const Vector3d& start) {
  constexpr int kSteps = 60;
  CoverBall ball{start, 0.0};
  for (int k = 1;; ++k) {
    const Vector3d* farthest = &points.front();
    double most = 0.0;
    for (const Vector3d& p : points) {
      const double square = (p - ball.center).squaredNorm();
      if (square > most) most = square, farthest = &p;
    }
    ball.radius = (*farthest - ball.center).norm();
    if (k > kSteps) return ball;
    ball.center += (*farthest - ball.center) / (k + 1.0);
  }
}

double reach_of(std::span<const Solid> solids, const CoverBall& ball) {
  return ball.radius + signed_distance(solids, ball.center);
}

double reach_of(std::span<const Solid> solids, std::span<const CoverBall> balls) {
  double reach = 0.0;
  for (const CoverBall& ball : balls) reach = std::max(reach, reach_of(solids, ball));
  return reach;
}

/// Each point belongs to the ball in which it is deepest.
std::vector<std::vector<Vector3d>> shared_out(const std::vector<Vector3d>& points,
                                              const std::vector<CoverBall>& balls) {
  std::vector<std::vector<Vector3d>> own(balls.size());
  for (const Vector3d& p : points) {
    const auto out = [&p](const CoverBall& b) { return (p - b.center).norm() - b.radius; };
    const auto mine = std::ranges::min_element(balls, {}, out);
    own[static_cast<std::size_t>(mine - balls.begin())].push_back(p);
  }
  return own;
}

/// Each ball becomes the one that its points need, or goes if it has none.
void tighten(std::span<const Solid> solids, const std::vector<Vector3d>& points,
             std::vector<CoverBall>& balls) {
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    const auto own = shared_out(points, balls);
    std::vector<CoverBall> tight;
    for (std::size_t i = 0; i < balls.size(); ++i) {
      if (own[i].empty()) continue;
      CoverBall kept{balls[i].center, 0.0};
      for (const Vector3d& p : own[i])
        kept.radius = std::max(kept.radius, (p - kept.center).norm());
      const CoverBall moved = around(own[i], kept.center);
      tight.push_back(reach_of(solids, moved) < reach_of(solids, kept) ? moved : kept);
    }
    balls = std::move(tight);
  }
}

/// Takes away balls, those of the fewest points first, that the others can do without when they
/// move, as long as none reaches out by more than `allowed`.
void prune(std::span<const Solid> solids, const std::vector<Vector3d>& points, double allowed,
           std::vector<CoverBall>& balls) {
  constexpr std::size_t kTries = 6;
  for (bool again = true; again && balls.size() > 1;) {
    again = false;
    std::vector<std::pair<std::size_t, std::size_t>> order;  // points, ball
    const auto own = shared_out(points, balls);
    for (std::size_t i = 0; i < balls.size(); ++i) order.emplace_back(own[i].size(), i);
    std::ranges::sort(order);
    for (std::size_t i = 0; i < std::min(kTries, order.size()) && !again; ++i) {
      std::vector<CoverBall> fewer = balls;
      fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(order[i].second));
      tighten(solids, points, fewer);
      again = reach_of(solids, fewer) <= allowed;
      if (again) balls = std::move(fewer);
    }
  }
}

/// Divides space into cubes until each is outside of the solids or in one ball. Of those that are
/// neither, `half_m` small: the middles, or their feet on the solids; with `grow`, the ball grows
/// that has to grow least.
std::vector<Vector3d> gaps_between(std::vector<CoverBall>& balls, std::span<const Solid> solids,
                                   double half_m, bool grow) {
  struct Cube {
    Vector3d center;
    double half;
  };
  const AlignedBox3d box = box_of(solids);
  std::vector<Cube> open{{box.center(), 0.5 * box.sizes().maxCoeff()}};
  std::vector<Vector3d> gaps;
  while (!open.empty()) {
    const Cube cube = open.back();
    open.pop_back();
    const auto lacks = [&cube](const CoverBall& b) {
      return ((cube.center - b.center).cwiseAbs() + Vector3d::Constant(cube.half)).norm() -
             b.radius;
    };
    const auto nearest = std::ranges::min_element(balls, {}, lacks);
    const double lack = lacks(*nearest);
    if (lack <= 0.0) continue;
    const double distance = signed_distance(solids, cube.center);
    if (distance > std::sqrt(3.0) * cube.half) continue;
    if (cube.half <= half_m) {
      gaps.push_back(distance > 0.0 ? foot(solids, cube.center, distance) : cube.center);
      if (grow) nearest->radius += lack + 1e-12;
      continue;
    }
    const double half = 0.5 * cube.half;
    for (int i = 0; i < 8; ++i) {
      open.push_back(
          {cube.center + half * Vector3d(i & 1 ? 1 : -1, i & 2 ? 1 : -1, i & 4 ? 1 : -1), half});
    }
  }
  return gaps;
}

}  // namespace

double signed_distance(std::span<const Solid> solids, const Vector3d& p_L) {
  double least = std::numeric_limits<double>::infinity();
  for (const Solid& solid : solids) least = std::min(least, signed_distance(solid, p_L));
  return least;
}

std::vector<CoverBall> cover_balls(std::span<const Solid> solids, const CoverSettings& settings) {
  constexpr double kMore = 1.12, kSlack = 0.12;
  constexpr int kTries = 4, kFinest = 32;
  const auto most = static_cast<std::size_t>(settings.most_balls);
  Samples samples = sample(solids);
  std::vector<Vector3d>& points = samples.points;
  for (double allowed = settings.tolerance_m;; allowed *= kMore) {
    for (int i = 1; i <= kTries; ++i) {  // with ever more slack for what is between the points
      const double aim = (1.0 - kSlack * i) * allowed;
      std::vector<CoverBall> balls = greedy(samples, aim, 2 * most);
      if (balls.size() > 2 * most) break;
      tighten(solids, points, balls);
      prune(solids, points, aim, balls);
      if (balls.size() > most) break;
      for (int share = kFinest / 8; share <= kFinest; share *= 2) {
        const auto gaps = gaps_between(balls, solids, allowed / share, false);
        points.insert(points.end(), gaps.begin(), gaps.end());
        tighten(solids, points, balls);
      }
      gaps_between(balls, solids, allowed / kFinest, true);
      if (reach_of(solids, balls) <= allowed) return balls;
    }
  }
}

OverCoverage over_coverage(std::span<const Solid> solids, std::span<const CoverBall> balls) {
  constexpr int kPoints = 1 << 16;
  AlignedBox3d box = box_of(solids);
  for (const CoverBall& b : balls) {
    box.extend(b.center + Vector3d::Constant(b.radius));
    box.extend(b.center - Vector3d::Constant(b.radius));
  }
  // Roberts' sequence: multiples of the powers of 1/g, g⁴ = g + 1.
  constexpr double kG = 1.2207440846057596;
  const Vector3d by(1.0 / kG, 1.0 / (kG * kG), 1.0 / (kG * kG * kG));
  int in_solid = 0, in_balls = 0, bare = 0;
  for (int i = 0; i < kPoints; ++i) {
    const Vector3d turn = Vector3d::Constant(0.5) + i * by;
    const Vector3d p = box.min() + (turn - turn.array().floor().matrix()).cwiseProduct(box.sizes());
    const bool solid = signed_distance(solids, p) <= 0.0;
    const bool covered = std::ranges::any_of(balls, [&p](const CoverBall& b) {
      return (p - b.center).squaredNorm() <= b.radius * b.radius;
    });
    in_solid += solid;
    in_balls += covered;
    bare += solid && !covered;
  }
  const double each = box.volume() / kPoints;
  return {reach_of(solids, balls), each * in_solid, each * in_balls, each * bare};
}

namespace {

using Eigen::Vector3d;
using Triangle = TriangleMesh::Triangle;

Vector3d middle_of(const Triangle& t) { return (t[0] + t[1] + t[2]) / 3.0; }
Vector3d area_of(const Triangle& t) { return 0.5 * (t[1] - t[0]).cross(t[2] - t[0]); }

double to_edge(const Vector3d& p, const Vector3d& a, const Vector3d& b) {
  const Vector3d along = b - a;
  const double length2 = along.squaredNorm();
  const double share = length2 > 0.0 ? std::clamp((p - a).dot(along) / length2, 0.0, 1.0) : 0.0;
  return (p - a - share * along).norm();
}

double to_triangle(const Vector3d& p, const Triangle& t) {
  const Vector3d n = area_of(t);
  bool above = n.squaredNorm() > 0.0;  // the foot of p is between all edges
  for (std::size_t i = 0; above && i < 3; ++i)
    above = n.cross(t[(i + 1) % 3] - t[i]).dot(p - t[i]) >= 0.0;
  if (above) return std::abs((p - t[0]).dot(n.normalized()));
  return std::min({to_edge(p, t[0], t[1]), to_edge(p, t[1], t[2]), to_edge(p, t[2], t[0])});
}

/// Solid angle under which p sees the triangle, over 4π (van Oosterom and Strackee 1983).
double turns(const Vector3d& p, const Triangle& t) {
  const Vector3d a = t[0] - p, b = t[1] - p, c = t[2] - p;
  const double la = a.norm(), lb = b.norm(), lc = c.norm();
  return std::atan2(a.dot(b.cross(c)),
                    la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb) /
         (2.0 * std::numbers::pi);
}

}  // namespace

TriangleMesh::TriangleMesh(std::vector<Triangle> triangles) : triangles_(std::move(triangles)) {
  if (triangles_.empty()) throw ConfigError("has no triangles");
  for (const Triangle& t : triangles_) {
    for (const Vector3d& p : t)
      if (!p.allFinite()) throw ConfigError("has a coordinate that is not finite");
  }
  build(0, triangles_.size());
}

std::size_t TriangleMesh::build(std::size_t begin, std::size_t end) {
  constexpr std::size_t kLeaf = 4;
  const std::size_t index = nodes_.size();
  Node node;
  node.begin = begin;
  node.end = end;
  double weight = 0.0;
  for (std::size_t i = begin; i < end; ++i) {
    for (const Vector3d& p : triangles_[i]) node.box.extend(p);
    const Vector3d area = area_of(triangles_[i]);
    node.area += area;
    node.middle += area.norm() * middle_of(triangles_[i]);
    weight += area.norm();
  }
  node.middle = weight > 0.0 ? Vector3d(node.middle / weight) : node.box.center();
  for (std::size_t i = begin; i < end; ++i) {
    for (const Vector3d& p : triangles_[i])
      node.reach = std::max(node.reach, (p - node.middle).norm());
  }
  nodes_.push_back(node);
  if (end - begin <= kLeaf) return index;
  Eigen::Index axis = 0;
  node.box.sizes().maxCoeff(&axis);
  const std::size_t half = begin + (end - begin) / 2;
  const auto at = [this](std::size_t i) {
    return triangles_.begin() + static_cast<std::ptrdiff_t>(i);
  };
  std::nth_element(at(begin), at(half), at(end), [axis](const Triangle& a, const Triangle& b) {
    return middle_of(a)[axis] < middle_of(b)[axis];
  });
  build(begin, half);
  const std::size_t right = build(half, end);
  nodes_[index].right = right;
  return index;
}

double TriangleMesh::distance(const Vector3d& p) const {
  double best = std::numeric_limits<double>::infinity();
  std::array<std::size_t, 64> open{};  // a median tree of 2⁶⁰ triangles is no deeper
  std::size_t count = 1;
  while (count > 0) {
    const Node& node = nodes_[open[--count]];
    if (node.box.exteriorDistance(p) >= best) continue;
    if (node.right == 0) {
      for (std::size_t i = node.begin; i < node.end; ++i)
        best = std::min(best, to_triangle(p, triangles_[i]));
      continue;
    }
    const auto left = static_cast<std::size_t>(&node - nodes_.data()) + 1;
    const bool right_first = nodes_[node.right].box.squaredExteriorDistance(p) <
                             nodes_[left].box.squaredExteriorDistance(p);
    open[count++] = right_first ? left : node.right;
    open[count++] = right_first ? node.right : left;
  }
  return best;
}

double TriangleMesh::winding(const Vector3d& p) const {
  constexpr double kFar = 2.0;  // times the reach of a dipole
  double sum = 0.0;
  std::array<std::size_t, 64> open{};
  std::size_t count = 1;
  while (count > 0) {
    const Node& node = nodes_[open[--count]];
    const Vector3d to = node.middle - p;
    const double distance = to.norm();
    if (distance > kFar * node.reach && distance > 0.0) {
      sum += to.dot(node.area) / (4.0 * std::numbers::pi * distance * distance * distance);
    } else if (node.right == 0) {
      for (std::size_t i = node.begin; i < node.end; ++i) sum += turns(p, triangles_[i]);
    } else {
      open[count++] = node.right;
      open[count++] = static_cast<std::size_t>(&node - nodes_.data()) + 1;
    }
  }
  return sum;
}

}  // namespace mimesis::robot
