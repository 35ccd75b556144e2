#include "nodes/walker/stabilizer/polygon.h"

#include <algorithm>
#include <limits>

#include "common/error.h"

namespace mimesis::walker {
namespace {

/// > 0 if o → a → b turns left.
double turn(const Eigen::Vector2d& o, const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return (a.x() - o.x()) * (b.y() - o.y()) - (a.y() - o.y()) * (b.x() - o.x());
}

Eigen::Vector2d nearest_on_edge(const Eigen::Vector2d& a, const Eigen::Vector2d& b,
                                const Eigen::Vector2d& p) {
  const Eigen::Vector2d along = b - a;
  const double length2 = along.squaredNorm();
  if (length2 == 0.0) return a;
  return a + std::clamp((p - a).dot(along) / length2, 0.0, 1.0) * along;
}

}  // namespace

Polygon::Polygon(std::span<const Eigen::Vector2d> points) {
  MIMESIS_ASSERT(!points.empty() && points.size() <= std::size_t(kMost));
  std::array<Eigen::Vector2d, kMost> sorted;
  const int n = static_cast<int>(points.size());
  std::copy(points.begin(), points.end(), sorted.begin());
  std::sort(sorted.begin(), sorted.begin() + n, [](const auto& a, const auto& b) {
    return a.x() < b.x() || (a.x() == b.x() && a.y() < b.y());
  });
  const auto add = [this](const Eigen::Vector2d& p, int from) {
    while (size_ - from >= 2 &&
           turn(corner_[std::size_t(size_ - 2)], corner_[std::size_t(size_ - 1)], p) <= 0.0) {
      --size_;
    }
    corner_[std::size_t(size_++)] = p;
  };
  for (int i = 0; i < n; ++i) add(sorted[std::size_t(i)], 0);  // lower side
  const int lower = size_ - 1;
  for (int i = n - 2; i >= 0; --i) add(sorted[std::size_t(i)], lower);  // upper side
  if (size_ > 1) --size_;                                               // the first corner again
}

bool Polygon::contains(const Eigen::Vector2d& p) const {
  if (size_ < 3) return false;
  for (int i = 0; i < size_; ++i) {
    if (turn(corner_[std::size_t(i)], corner_[std::size_t((i + 1) % size_)], p) < 0.0) return false;
  }
  return true;
}

Eigen::Vector2d Polygon::nearest(const Eigen::Vector2d& p) const {
  if (contains(p)) return p;
  Eigen::Vector2d best = corner_[0];
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < size_; ++i) {
    const Eigen::Vector2d q =
        nearest_on_edge(corner_[std::size_t(i)], corner_[std::size_t((i + 1) % size_)], p);
    if ((q - p).squaredNorm() < least) {
      least = (q - p).squaredNorm();
      best = q;
    }
  }
  return best;
}

}  // namespace mimesis::walker
