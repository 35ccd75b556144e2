#pragma once
#include <Eigen/Core>
#include <limits>
#include <span>

namespace mimesis::crowd {

/// v·n ≤ limit. Limits are not negative: an agent at rest breaks none.
struct Bound {
  Eigen::Vector2d n;  ///< unit vector to the other
  double limit_m_s;
};

/// Largest speed of an agent towards another: with h = gap/(2 headway) and m the mean of both
/// velocities along n, v·n ≤ h + clamp(m, ±h). The other has n and m with the opposite sign, so
/// together they close at most gap/headway: the gap never gets negative, in steps shorter than the
/// headway. An agent that follows another may go as fast as that one. Barrier functions of this
/// form are in [Ames et al., ECC 2019], halves of the velocity in RVO [van den Berg et al., ICRA
/// 2008].
inline double shared_limit(double gap_m, double headway_s, double mean_m_s) {
  const double h = gap_m > 0.0 ? gap_m / (2.0 * headway_s) : 0.0;
  const double m = mean_m_s < h ? mean_m_s : h;
  return h + (m > -h ? m : -h);
}

/// Limit where the other does not yield and goes at `other_m_s` along n. Below zero: step back.
inline double lone_limit(double gap_m, double headway_s, double other_m_s) {
  return (gap_m > 0.0 ? gap_m / headway_s : 0.0) + other_m_s;
}

/// The velocity within all bounds that is nearest to the wish; never faster than the wish.
/// O(bounds²), in the order of the bounds.
Eigen::Vector2d nearest_within(const Eigen::Vector2d& wish_m_s, std::span<const Bound> bounds);

/// The tightest of all bounds, and below them a speed that keeps those that found no room.
class Bounds {
 public:
  void add(const Bound& bound);
  /// Like `nearest_within`.
  Eigen::Vector2d nearest(const Eigen::Vector2d& wish_m_s) const;

 private:
  static constexpr std::size_t kMost = 48;  // discs that are equal: no more than 6 touch one
  Bound bounds_[kMost];
  std::size_t count_ = 0;
  double speed_ = std::numeric_limits<double>::infinity();
};

}  // namespace mimesis::crowd
