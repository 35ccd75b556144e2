#include "nodes/crowd/ways/ways.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <queue>

#include "common/math/circle.h"

namespace mimesis::crowd {
namespace {

using Eigen::Vector2d;
constexpr double kPi = std::numbers::pi;
constexpr double kSide_rad = 0.25 * kPi;  // of the polygons around ends of walls
const double kTangent = std::sin(0.5 * kSide_rad) + 1e-3;
constexpr double kRound = 1e-9, kHere_m = 1e-6, kNearer = 0.85;
constexpr double kInfinite = std::numeric_limits<double>::infinity();

double cross(const Vector2d& a, const Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); }

double distance(const Vector2d& p, const Wall& w) {
  const Vector2d along = w.to_W_m - w.from_W_m;
  const double share = std::clamp((p - w.from_W_m).dot(along) / along.squaredNorm(), 0.0, 1.0);
  return (w.from_W_m + share * along - p).norm();
}

bool crosses(const Vector2d& a, const Vector2d& b, const Wall& w) {
  const Vector2d way = b - a, along = w.to_W_m - w.from_W_m;
  const double from = cross(way, w.from_W_m - a), to = cross(way, w.to_W_m - a);
  const double before = cross(along, a - w.from_W_m), after = cross(along, b - w.from_W_m);
  return from * to <= 0.0 && before * after <= 0.0 && (from != 0.0 || to != 0.0);
}

/// Of two segments.
double distance(const Vector2d& a, const Vector2d& b, const Wall& w) {
  if (a == b) return distance(a, w);
  if (crosses(a, b, w)) return 0.0;
  const Wall way{a, b};
  return std::min(
      {distance(a, w), distance(b, w), distance(w.from_W_m, way), distance(w.to_W_m, way)});
}

bool far(const Vector2d& a, const Vector2d& b, const Wall& w, double least) {
  return std::max(a.x(), b.x()) + least < std::min(w.from_W_m.x(), w.to_W_m.x()) ||
         std::min(a.x(), b.x()) - least > std::max(w.from_W_m.x(), w.to_W_m.x()) ||
         std::max(a.y(), b.y()) + least < std::min(w.from_W_m.y(), w.to_W_m.y()) ||
         std::min(a.y(), b.y()) - least > std::max(w.from_W_m.y(), w.to_W_m.y());
}

Vector2d corner(const Polygon& polygon, std::size_t i) {
  return {polygon.corner_m[2 * i], polygon.corner_m[2 * i + 1]};
}

}  // namespace

bool meet(const Wall& a, const Wall& b) { return distance(a.from_W_m, a.to_W_m, b) < kRound; }

bool inside(const Polygon& polygon, const Vector2d& p) {
  const std::size_t n = polygon.corner_m.size() / 2;
  bool in = false;
  for (std::size_t i = 0; i < n; ++i) {
    const Vector2d a = corner(polygon, i), b = corner(polygon, (i + 1) % n);
    if (a != b && distance(p, Wall{a, b}) < kRound) return true;
    if ((a.y() > p.y()) != (b.y() > p.y()) &&
        p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) {
      in = !in;
    }
  }
  return in;
}

std::vector<Wall> edges(std::span<const Wall> walls, std::span<const Polygon> polygons) {
  std::vector<Wall> all(walls.begin(), walls.end());
  for (const Polygon& p : polygons) {
    const std::size_t n = p.corner_m.size() / 2;
    for (std::size_t i = 0; i < n; ++i) all.push_back({corner(p, i), corner(p, (i + 1) % n)});
  }
  return all;
}

Ways::Ways(std::span<const Wall> walls, std::span<const Polygon> polygons, double clearance_m)
    : clearance_m_(clearance_m), walls_(edges(walls, polygons)) {
  add_bends(polygons);
  links_.resize(bends_.size());
  for (std::size_t i = 0; i < bends_.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Vector2d way = bends_[i] - bends_[j];
      const double length = way.norm(), turned = kTangent * length;
      // A way that bends is tangent to what it bends about.
      if (std::abs(way.dot(outwards_[i])) > turned || std::abs(way.dot(outwards_[j])) > turned ||
          !sees(bends_[i], bends_[j])) {
        continue;
      }
      links_[i].push_back({static_cast<int>(j), length});
      links_[j].push_back({static_cast<int>(i), length});
    }
  }
}

void Ways::add_bends(std::span<const Polygon> polygons) {
  std::map<std::pair<double, double>, std::vector<double>> ends;  // directions of walls from there
  for (const Wall& w : walls_) {
    const Vector2d along = w.to_W_m - w.from_W_m;
    const double angle = std::atan2(along.y(), along.x());
    ends[{w.from_W_m.x(), w.from_W_m.y()}].push_back(angle);
    ends[{w.to_W_m.x(), w.to_W_m.y()}].push_back(math::wrap_pi(angle + kPi));
  }
  const double wide = clearance_m_ / std::cos(0.5 * kSide_rad) * (1.0 + 1e-6);
  for (auto& [place, angles] : ends) {
    std::ranges::sort(angles);
    for (std::size_t k = 0; k < angles.size(); ++k) {
      const double first = angles[k];
      const double gap =
          k + 1 < angles.size() ? angles[k + 1] - first : angles[0] + math::kTwoPi - first;
      const double turn = gap - kPi;  // a way bends by this at most
      if (turn < 1e-6) continue;
      const int sides = static_cast<int>(std::ceil(turn / kSide_rad - 1e-9));
      for (int s = 0; s <= sides; ++s) {
        const double angle = first + 0.5 * kPi + turn * s / sides;
        const Vector2d outwards(std::cos(angle), std::sin(angle));
        const Vector2d bend = Vector2d(place.first, place.second) + wide * outwards;
        const bool in = std::ranges::any_of(
            polygons, [&](const Polygon& polygon) { return inside(polygon, bend); });
        if (in || clearance(bend) < clearance_m_) continue;
        bends_.push_back(bend);
        outwards_.push_back(outwards);
      }
    }
  }
}

double Ways::clearance(const Vector2d& p) const {
  double least = kInfinite;
  for (const Wall& w : walls_) least = std::min(least, distance(p, w));
  return least;
}

bool Ways::free(const Vector2d& a, const Vector2d& b, double clearance_m) const {
  for (const Wall& w : walls_) {
    if (far(a, b, w, clearance_m)) continue;
    // Who stands nearer to a wall, or goes there, may.
    const double least = std::min({clearance_m, distance(a, w), distance(b, w)});
    const double nearest = distance(a, b, w);
    if (nearest == 0.0 || nearest < least * (1.0 - 1e-6)) return false;
  }
  return true;
}

const Ways::Costs& Ways::costs_to(const Vector2d& goal) {
  constexpr std::size_t kMostKnown = 8'000'000;  // costs, 64 MB; forgotten goals are found again
  if ((known_.size() + 1) * bends_.size() > kMostKnown) known_.clear();
  const auto [found, is_new] = known_.try_emplace({goal.x(), goal.y()});
  Costs& costs = found->second;
  if (!is_new) return costs;
  costs.assign(bends_.size(), kInfinite);
  using Open = std::pair<double, int>;
  std::priority_queue<Open, std::vector<Open>, std::greater<>> open;
  for (std::size_t i = 0; i < bends_.size(); ++i) {
    if (!sees(bends_[i], goal)) continue;
    costs[i] = (bends_[i] - goal).norm();
    open.push({costs[i], static_cast<int>(i)});
  }
  while (!open.empty()) {
    const auto [cost, i] = open.top();
    open.pop();
    if (cost > costs[static_cast<std::size_t>(i)]) continue;
    for (const Link& link : links_[static_cast<std::size_t>(i)]) {
      double& other = costs[static_cast<std::size_t>(link.to)];
      if (cost + link.length_m >= other) continue;
      other = cost + link.length_m;
      open.push({other, link.to});
    }
  }
  return costs;
}

/// −1: the goal itself, or no way if the length is infinite.
std::pair<int, double> Ways::first_bend(const Vector2d& from, const Vector2d& goal) {
  if (free(from, goal, kNearer * clearance_m_)) return {-1, (goal - from).norm()};
  const Costs& costs = costs_to(goal);
  std::vector<std::pair<double, int>> open;  // least first
  for (std::size_t i = 0; i < bends_.size(); ++i) {
    const double way = (bends_[i] - from).norm();
    if (way > kHere_m && costs[i] < kInfinite)
      open.emplace_back(way + costs[i], static_cast<int>(i));
  }
  const auto later = std::greater<>();
  std::ranges::make_heap(open, later);
  for (; !open.empty(); open.pop_back()) {
    std::ranges::pop_heap(open, later);
    const auto [length, bend] = open.back();
    // Who has come to a bend goes on to what is seen from a little nearer to the wall, too.
    if (free(from, bends_[static_cast<std::size_t>(bend)], kNearer * clearance_m_))
      return {bend, length};
  }
  return {-1, kInfinite};
}

std::optional<Vector2d> Ways::next(const Vector2d& from, const Vector2d& goal) {
  const auto [bend, length] = first_bend(from, goal);
  if (length == kInfinite) return std::nullopt;
  return bend < 0 ? goal : bends_[static_cast<std::size_t>(bend)];
}

std::optional<double> Ways::length_m(const Vector2d& from, const Vector2d& goal) {
  const double length = first_bend(from, goal).second;
  return length == kInfinite ? std::nullopt : std::optional(length);
}

}  // namespace mimesis::crowd
