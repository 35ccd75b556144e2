#include "nodes/crowd/engine/testing/navigation.h"

#include <cmath>

#include "common/math/circle.h"

namespace mimesis::crowd {
namespace {

double direction(const Eigen::Vector2d& v) { return std::atan2(v.y(), v.x()); }

Eigen::Vector2d velocity(const Pedestrian& w) {
  return w.speed_m_s * Eigen::Vector2d(std::cos(w.heading_rad), std::sin(w.heading_rad));
}

/// sin(φ − φ_o) with the two Gaussians.
double turn_away(double heading_rad, double direction_rad, double distance_m,
                 const NavigationParams& p) {
  const double off = math::wrap_pi(heading_rad - direction_rad - p.keep_right_rad);
  const double a = off / p.sigma_angle_rad, d = distance_m / p.sigma_distance_m;
  return std::sin(off) * std::exp(-0.5 * (a * a + d * d));
}

}  // namespace

ClosestApproach closest_approach(const Pedestrian& self, const Pedestrian& other) {
  const Eigen::Vector2d r = other.position_W_m - self.position_W_m;
  const Eigen::Vector2d v = velocity(other) - velocity(self);
  ClosestApproach c{false, 0.0, r.norm(), direction(r)};
  const double v2 = v.squaredNorm();
  if (v2 < 1e-12 || r.dot(v) >= 0.0) return c;  // side by side, or parting
  c.ahead = true;
  c.time_s = -r.dot(v) / v2;
  c.distance_m = (r + c.time_s * v).norm();
  const Eigen::Vector2d there = r + c.time_s * velocity(other);
  c.direction_rad = there.norm() > 1e-9 ? direction(there) : self.heading_rad;
  return c;
}

double goal_term(const Pedestrian& self, const Eigen::Vector2d& goal) {
  const Eigen::Vector2d to = goal - self.position_W_m;
  return to.norm() < 1e-9 ? 0.0 : std::sin(direction(to) - self.heading_rad);
}

double avoidance_term(const Pedestrian& self, const Pedestrian& other, const NavigationParams& p) {
  const Eigen::Vector2d to = other.position_W_m - self.position_W_m;
  return turn_away(self.heading_rad, direction(to), to.norm(), p);
}

double prediction_term(const Pedestrian& self, const Pedestrian& other, const NavigationParams& p) {
  const ClosestApproach c = closest_approach(self, other);
  if (!c.ahead) return 0.0;
  return turn_away(self.heading_rad, c.direction_rad, c.distance_m, p) *
         std::exp(-c.time_s / p.horizon_s);
}

double heading_rate(const Pedestrian& self, const Eigen::Vector2d& goal, double goal_1_s,
                    std::span<const Pedestrian> others, const NavigationParams& p) {
  double rate = goal_1_s * goal_term(self, goal);
  for (const Pedestrian& other : others) {
    rate += p.avoid_1_s * avoidance_term(self, other, p) +
            p.predict_1_s * prediction_term(self, other, p);
  }
  return rate;
}

}  // namespace mimesis::crowd
