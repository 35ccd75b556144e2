#include "nodes/planner/shortcut.h"

#include <algorithm>
#include <cmath>
#include <random>

namespace mimesis::planner {
namespace {

using Waypoints = std::vector<Eigen::VectorXd>;

/// From each waypoint to the farthest later one that can be reached straight.
Waypoints without_detours(const Waypoints& path, const Certify& certify) {
  Waypoints kept{path.front()};
  for (std::size_t i = 0; i + 1 < path.size();) {
    std::size_t j = path.size() - 1;
    while (j > i + 1 && !certify(path[i], path[j])) --j;
    kept.push_back(path[j]);
    i = j;
  }
  return kept;
}

struct Spot {
  std::size_t part = 0;  // between waypoints part and part + 1
  Eigen::VectorXd q;
};

Spot spot_at(const Waypoints& path, double length) {
  for (std::size_t i = 0; i + 1 < path.size(); ++i) {
    const double part = (path[i + 1] - path[i]).norm();
    if (length <= part || i + 2 == path.size()) {
      const double u = std::clamp(length / part, 0.0, 1.0);
      return {i, (1.0 - u) * path[i] + u * path[i + 1]};
    }
    length -= part;
  }
  return {0, path.front()};
}

double length_of(const Waypoints& path) {
  double sum = 0.0;
  for (std::size_t i = 1; i < path.size(); ++i) sum += (path[i] - path[i - 1]).norm();
  return sum;
}

Waypoints without_doubles(const Waypoints& path) {
  Waypoints kept{path.front()};
  for (std::size_t i = 1; i < path.size(); ++i) {
    if ((path[i] - kept.back()).norm() > 1e-6) kept.push_back(path[i]);
  }
  if (kept.size() > 1) kept.back() = path.back();
  return kept;
}

}  // namespace

std::vector<Eigen::VectorXd> shortened(std::vector<Eigen::VectorXd> path, const Certify& certify,
                                       int attempts, std::uint64_t seed) {
  path = without_doubles(without_detours(path, certify));
  std::mt19937_64 random(seed);
  const auto unit = [&] { return std::ldexp(static_cast<double>(random() >> 11), -53); };
  for (int i = 0; i < attempts && path.size() > 2; ++i) {
    const double length = length_of(path);
    const double first = unit() * length, second = unit() * length;
    const Spot a = spot_at(path, std::min(first, second)),
               b = spot_at(path, std::max(first, second));
    if (a.part == b.part || !certify(a.q, b.q)) continue;
    Waypoints next(path.begin(), path.begin() + static_cast<std::ptrdiff_t>(a.part) + 1);
    next.push_back(a.q);
    next.push_back(b.q);
    next.insert(next.end(), path.begin() + static_cast<std::ptrdiff_t>(b.part) + 1, path.end());
    path = without_doubles(next);
  }
  return without_doubles(without_detours(path, certify));
}

}  // namespace mimesis::planner
