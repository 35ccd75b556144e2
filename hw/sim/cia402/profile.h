#pragma once
#include <algorithm>
#include <cmath>

namespace mimesis::hw::sim {

/// Trapezoidal motion in steps: never faster than `v_max`, and never faster than it can still stop
/// at the target with `deceleration`. Over a step T the largest such speed at distance d is
///   w = √((aT/2)² + 2a|d|) − aT/2.
struct Profile {
  double position = 0.0;  ///< [rad]
  double velocity = 0.0;  ///< [rad/s]

  void towards(double target, double v_max, double acceleration, double deceleration, double dt) {
    const double distance = target - position, half = 0.5 * deceleration * dt;
    const double stoppable =
        std::sqrt(half * half + 2.0 * deceleration * std::abs(distance)) - half;
    const double wanted = std::copysign(std::min(v_max, stoppable), distance);
    change(wanted, acceleration, deceleration, dt);
    if (std::abs(distance) <= std::abs(velocity) * dt && std::abs(velocity) <= deceleration * dt) {
      position = target;
      velocity = 0.0;
    } else {
      position += velocity * dt;
    }
  }
  /// Velocity towards `wanted`, with the deceleration where it becomes slower; the caller moves.
  void change(double wanted, double acceleration, double deceleration, double dt) {
    const bool slower = velocity * (wanted - velocity) < 0.0;
    const double step = (slower ? deceleration : acceleration) * dt;
    velocity += std::clamp(wanted - velocity, -step, step);
  }
};

}  // namespace mimesis::hw::sim
