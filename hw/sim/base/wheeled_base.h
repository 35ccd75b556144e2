#pragma once
#include <Eigen/Core>

namespace mimesis::hw::sim {

/// Of a base with two driven wheels.
struct BaseLimits {
  double v_max_m_s = 1.0;
  double turn_max_rad_s = 1.5;
  double a_max_m_s2 = 1.0;         ///< of its speed
  double turn_a_max_rad_s2 = 4.0;  ///< of its turning
  double turn_gain_1_s = 2.0;      ///< of the turn to the wished heading
};

/// What it shall do: as a walker steps, so that it keeps time with walkers.
struct BaseWish {
  double phase_rate_rad_s = 0.0;
  double speed_m_s = 0.0;  ///< mean of a cycle
  double heading_rad = 0.0;
};

/// Unicycle: ẋ = v cos ψ, ẏ = v sin ψ, with bounded v̇ and ψ̈. Beside it a phase, which it only
/// keeps: it has no feet.
class WheeledBase {
 public:
  WheeledBase(const BaseLimits& limits, const Eigen::Vector2d& position_W_m, double heading_rad)
      : limits_(limits), position_(position_W_m), heading_(heading_rad) {}

  void step(double dt_s, const BaseWish& wish);
  /// Slows down, and its phase stands.
  void stop(double dt_s) { step(dt_s, {.heading_rad = heading_}); }

  const Eigen::Vector2d& position_W_m() const { return position_; }
  double heading_rad() const { return heading_; }
  double speed_m_s() const { return speed_; }
  double phase_rad() const { return phase_; }
  double phase_rate_rad_s() const { return phase_rate_; }

 private:
  BaseLimits limits_;
  Eigen::Vector2d position_;
  double heading_, speed_ = 0.0, turn_ = 0.0, phase_ = 0.0, phase_rate_ = 0.0;
};

}  // namespace mimesis::hw::sim
