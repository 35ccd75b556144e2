#pragma once
#include <Eigen/Core>
#include <span>

#include "nodes/crowd/rules/rules.h"

// The heading dynamics as the equations are printed, one pair of walkers at a time: the reference
// for the engine's sums over lanes.
namespace mimesis::crowd {

/// A moving character, or an obstacle with speed zero. W: world, z up.
struct Pedestrian {
  Eigen::Vector2d position_W_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;  ///< φ, + to the left
  double speed_m_s = 0.0;
};

/// Closest approach of two walkers that go straight on.
struct ClosestApproach {
  bool ahead = false;          ///< false: in the past, or they keep their distance
  double time_s = 0.0;         ///< until then
  double distance_m = 0.0;     ///< between them then
  double direction_rad = 0.0;  ///< from `self` now to where `other` is then
};
ClosestApproach closest_approach(const Pedestrian& self, const Pedestrian& other);

/// sin(φ_goal − φ) [M18 eq. 3.25]; at the goal 0.
double goal_term(const Pedestrian& self, const Eigen::Vector2d& goal_W_m);
/// sin(φ − φᵢⱼ) exp(−(φᵢⱼ − φ)²/2σ_φ²) exp(−dᵢⱼ²/2σ_d²) [M18 eq. 3.26]: away from the other.
double avoidance_term(const Pedestrian& self, const Pedestrian& other, const NavigationParams& p);
/// avoidance_term() for the closest approach [M18 eq. 3.27], with d the distance at which they
/// would pass: so it acts early, and not where they would miss each other anyway.
double prediction_term(const Pedestrian& self, const Pedestrian& other, const NavigationParams& p);

/// dφ/dt [rad/s, M18 eq. 3.24] with `goal_1_s` as the strength of eq. 3.25. `others` may contain
/// obstacles. O(others), does not allocate.
double heading_rate(const Pedestrian& self, const Eigen::Vector2d& goal_W_m, double goal_1_s,
                    std::span<const Pedestrian> others, const NavigationParams& p = {});

}  // namespace mimesis::crowd
