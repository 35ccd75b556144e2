#pragma once
#include <Eigen/Core>
#include <cmath>
#include <numbers>

namespace mimesis::synthesizer {

enum class DanceSector { corridor = 1, parting = 2, outside = 3, entrance = 4 };

/// The closed way of the left row of dancers; the right row's is its mirror image in y = 0. W: the
/// corridor begins at the origin and goes along x. Places are arc lengths from its entrance: the
/// corridor, half a circle to the outside, straight back, half a circle to the entrance.
struct DanceTrack {
  double corridor_m = 10.0, radius_m = 1.6, half_width_m = 0.5;

  double curve_m() const { return std::numbers::pi * radius_m; }
  double length_m() const { return 2.0 * (corridor_m + curve_m()); }

  DanceSector sector(double s) const {
    if (s < corridor_m) return DanceSector::corridor;
    if (s < corridor_m + curve_m()) return DanceSector::parting;
    return s < 2.0 * corridor_m + curve_m() ? DanceSector::outside : DanceSector::entrance;
  }
  /// Direction of the way at s, s in [0, length); of the left row [rad].
  double heading(double s) const {
    switch (sector(s)) {
      case DanceSector::corridor:
        return 0.0;
      case DanceSector::parting:
        return (s - corridor_m) / radius_m;
      case DanceSector::outside:
        return std::numbers::pi;
      case DanceSector::entrance:
        return std::numbers::pi + (s - 2.0 * corridor_m - curve_m()) / radius_m;
    }
    return 0.0;
  }
  Eigen::Vector2d point(double s) const {
    const double a = heading(s), y = half_width_m + radius_m;
    const Eigen::Vector2d on_circle(radius_m * std::sin(a), y - radius_m * std::cos(a));
    switch (sector(s)) {
      case DanceSector::corridor:
        return {s, half_width_m};
      case DanceSector::parting:
        return {corridor_m + on_circle.x(), on_circle.y()};
      case DanceSector::outside:
        return {2.0 * corridor_m + curve_m() - s, half_width_m + 2.0 * radius_m};
      case DanceSector::entrance:
        return on_circle;
    }
    return {0.0, 0.0};
  }
  double wrapped(double s) const { return s - length_m() * std::floor(s / length_m()); }
};

}  // namespace mimesis::synthesizer
