#pragma once
#include "nodes/walker/pattern/pattern.h"

namespace mimesis::walker {

inline Eigen::Matrix2d rotation(double yaw_rad) {
  return Eigen::Rotation2Dd(yaw_rad).toRotationMatrix();
}

/// n · d ≤ b for the step d from one foot to the other, in the frame of the one that stands.
struct HalfPlane {
  Eigen::Vector2d normal;
  double offset;
};
inline constexpr int kStepSides = 5;

/// A wish that the robot can walk.
struct FeasibleWish {
  Eigen::Vector2d velocity_m_s = Eigen::Vector2d::Zero();
  double yaw_rate_rad_s = 0.0;
  bool walk = false;
  std::array<std::optional<Footprint>, 2> landing;
};

/// The foot to start with: the one whose landing is wished, else the one on the side that the walk
/// goes or turns to.
Side first_swing(const FeasibleWish& wish);

/// Where feet may land, and where they shall for a wished velocity.
class Footsteps {
 public:
  explicit Footsteps(const GaitSettings& settings);

  /// Limits of a step of `swing` from the other foot [walking.md 1.3 b].
  const std::array<HalfPlane, kStepSides>& limits(Side swing) const { return limits_[swing]; }
  /// By how much a step is beyond the limits [m]; ≤ 0: feasible.
  double beyond(Side swing, const Eigen::Vector2d& step_S_m) const;

  /// Step of `swing` from the other foot, in W, so that the pelvis moves with the velocity while it
  /// turns from yaw `from` to yaw `to`. Sideways the feet are as far apart as that needs.
  Eigen::Vector2d step_W_m(Side swing, double from_rad, double to_rad,
                           const Eigen::Vector2d& velocity_m_s) const;
  Footprint next(const Footprint& stance, const FeasibleWish& wish) const;
  /// Yaw of the foot that lands next to one with yaw `from`, towards `wished` as far as it may.
  double reachable_yaw(double from_rad, double wished_rad) const;
  /// `landing` if it can be reached from `stance`, else the last point on the way there from side
  /// by side that can.
  Footprint reachable(const Footprint& stance, const Footprint& landing) const;
  /// The foot side by side with `stance`.
  Footprint beside(const Footprint& stance) const;

  /// Cuts a wish to what can be walked; says in `trouble` what was wrong.
  FeasibleWish feasible(const Wish& wish, PatternTrouble& trouble) const;

 private:
  double fastest_share(const Eigen::Vector2d& velocity_m_s, double yaw_rate_rad_s) const;

  GaitSettings settings_;
  std::array<std::array<HalfPlane, kStepSides>, 2> limits_;
};

}  // namespace mimesis::walker
