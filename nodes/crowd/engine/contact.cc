#include "nodes/crowd/engine/contact.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace mimesis::crowd {
namespace {

/// The point nearest to `wish` on the line of bound k that is within all others.
bool on_line(const Eigen::Vector2d& wish, std::span<const Bound> bounds, std::size_t k,
             Eigen::Vector2d& best) {
  const Bound& line = bounds[k];
  const Eigen::Vector2d along(-line.n.y(), line.n.x()), foot = line.limit_m_s * line.n;
  double low = -std::numeric_limits<double>::infinity(), high = -low;
  for (std::size_t j = 0; j < bounds.size(); ++j) {
    if (j == k) continue;
    const double slope = bounds[j].n.dot(along);
    const double room = bounds[j].limit_m_s - bounds[j].n.dot(foot);
    if (std::abs(slope) < 1e-12) {
      if (room < -1e-12) return false;
    } else if (slope > 0.0) {
      high = std::min(high, room / slope);
    } else {
      low = std::max(low, room / slope);
    }
    if (low > high) return false;
  }
  best = foot + std::clamp(wish.dot(along), low, high) * along;
  return true;
}

}  // namespace

Eigen::Vector2d nearest_within(const Eigen::Vector2d& wish, std::span<const Bound> bounds) {
  const auto keeps = [&](const Bound& b) { return b.n.dot(wish) <= b.limit_m_s; };
  if (std::ranges::all_of(bounds, keeps)) return wish;
  // The nearest point is on the line of a bound that the wish breaks, or else no motion.
  Eigen::Vector2d best = Eigen::Vector2d::Zero();
  double least = wish.squaredNorm();
  for (std::size_t k = 0; k < bounds.size(); ++k) {
    Eigen::Vector2d v;
    if (keeps(bounds[k]) || !on_line(wish, bounds, k, v)) continue;
    const double off = (v - wish).squaredNorm();
    if (off < least) {
      least = off;
      best = v;
    }
  }
  return best;
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
  if (count_ == 0) return wish;
  const Eigen::Vector2d v = nearest_within(wish, {bounds_, count_});
  const double fast = std::sqrt(v.squaredNorm());
  return fast > speed_ ? Eigen::Vector2d(v * (speed_ / fast)) : v;
}

}  // namespace mimesis::crowd
