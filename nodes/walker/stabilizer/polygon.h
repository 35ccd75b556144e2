#pragma once
#include <Eigen/Core>
#include <array>
#include <span>

namespace mimesis::walker {

/// Convex polygon of at most eight corners: two soles. No allocation.
class Polygon {
 public:
  static constexpr int kMost = 8;
  /// Hull of `points` (1 to kMost), counter-clockwise [Andrew 1979].
  explicit Polygon(std::span<const Eigen::Vector2d> points);

  std::span<const Eigen::Vector2d> corners() const { return {corner_.data(), std::size_t(size_)}; }
  bool contains(const Eigen::Vector2d& p) const;
  /// p itself if it is inside, or the nearest point of the border.
  Eigen::Vector2d nearest(const Eigen::Vector2d& p) const;

 private:
  std::array<Eigen::Vector2d, 2 * kMost> corner_;
  int size_ = 0;
};

}  // namespace mimesis::walker
