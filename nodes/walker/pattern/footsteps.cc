#include "nodes/walker/pattern/footsteps.h"

#include <algorithm>
#include <cmath>

#include "common/math/circle.h"

namespace mimesis::walker {
namespace {

constexpr double kInside_m = 0.004;  // what stays free of the narrowest step and the limits

double clamp_to(double value, double most, bool& clipped) {
  clipped = clipped || std::abs(value) > most * (1.0 + 1e-12);
  return std::clamp(value, -most, most);
}

bool finite(const Footprint& foot) { return foot.p_W_m.allFinite() && std::isfinite(foot.yaw_rad); }

}  // namespace

Side first_swing(const FeasibleWish& wish) {
  if (wish.landing[0]) return wish.landing[0]->side;
  const double sideways = wish.velocity_m_s.y();
  return (sideways != 0.0 ? sideways : wish.yaw_rate_rad_s) < 0.0 ? kRight : kLeft;
}

Footsteps::Footsteps(const GaitSettings& s) : settings_(s) {
  const std::array<Eigen::Vector2d, kStepSides> corner{
      {{-s.longest_step_m, s.narrowest_step_m},
       {s.longest_step_m, s.narrowest_step_m},
       {5.0 / 7.0 * s.longest_step_m, s.widest_step_m},
       {0.0, 4.0 / 3.0 * s.widest_step_m},
       {-5.0 / 7.0 * s.longest_step_m, s.widest_step_m}}};
  for (std::size_t i = 0; i < kStepSides; ++i) {
    const Eigen::Vector2d edge = corner[(i + 1) % kStepSides] - corner[i];
    const Eigen::Vector2d normal = Eigen::Vector2d(edge.y(), -edge.x()).normalized();
    limits_[kLeft][i] = {normal, normal.dot(corner[i])};
    limits_[kRight][i] = {{normal.x(), -normal.y()}, normal.dot(corner[i])};
  }
}

double Footsteps::beyond(Side swing, const Eigen::Vector2d& step_S_m) const {
  double worst = -1e9;
  for (const HalfPlane& side : limits_[swing])
    worst = std::max(worst, side.normal.dot(step_S_m) - side.offset);
  return worst;
}

Eigen::Vector2d Footsteps::step_W_m(Side swing, double from_rad, double to_rad,
                                    const Eigen::Vector2d& v) const {
  const double T = settings_.step_s, distance = settings_.feet_distance_m;
  const double sideways = std::abs(v.y()) * T;
  const double spare = std::max(0.0, distance - settings_.narrowest_step_m - kInside_m);
  const double width = distance + sideways - std::min(spare, sideways);
  const Eigen::Vector2d out(0.0, robot::sign(swing) * width / 2.0);
  return rotation((from_rad + to_rad) / 2.0) * v * T + rotation(from_rad) * out +
         rotation(to_rad) * out;
}

double Footsteps::reachable_yaw(double from_rad, double wished_rad) const {
  const double most = settings_.most_foot_yaw_rad;
  return from_rad + std::clamp(math::wrap_pi(wished_rad - from_rad), -most, most);
}

Footprint Footsteps::next(const Footprint& stance, const FeasibleWish& wish) const {
  const Side swing = robot::other(stance.side);
  const double yaw =
      reachable_yaw(stance.yaw_rad, stance.yaw_rad + wish.yaw_rate_rad_s * settings_.step_s);
  return {swing, stance.p_W_m + step_W_m(swing, stance.yaw_rad, yaw, wish.velocity_m_s), yaw};
}

Footprint Footsteps::reachable(const Footprint& stance, const Footprint& landing) const {
  Footprint result = landing;
  result.yaw_rad = reachable_yaw(stance.yaw_rad, landing.yaw_rad);
  const Side swing = robot::other(stance.side);
  const Eigen::Matrix2d to_S = rotation(-stance.yaw_rad);
  const Eigen::Vector2d still = beside(stance).p_W_m, way = landing.p_W_m - still;
  double share = 1.0;
  for (const HalfPlane& side : limits_[swing]) {
    const double room = side.offset - side.normal.dot(to_S * (still - stance.p_W_m));
    const double used = side.normal.dot(to_S * way);
    if (used * share > room) share = room / used;
  }
  result.p_W_m = still + share * way;
  return result;
}

Footprint Footsteps::beside(const Footprint& stance) const { return next(stance, FeasibleWish{}); }

double Footsteps::fastest_share(const Eigen::Vector2d& v, double yaw_rate) const {
  double share = 1.0;
  for (const Side swing : robot::kSides) {
    const double to = reachable_yaw(0.0, yaw_rate * settings_.step_s);
    const Eigen::Vector2d still = step_W_m(swing, 0.0, to, Eigen::Vector2d::Zero());
    for (const HalfPlane& side : limits_[swing]) {
      const double room = side.offset - side.normal.dot(still);
      // step_W_m is piecewise linear in the speed: a few secants find the limit
      for (int i = 0; i < 3; ++i) {
        const double used = side.normal.dot(step_W_m(swing, 0.0, to, share * v) - still);
        if (used > room) share *= std::max(0.0, room) / used;
      }
    }
  }
  return share;
}

FeasibleWish Footsteps::feasible(const Wish& wish, PatternTrouble& trouble) const {
  FeasibleWish result;
  if (!wish.velocity_m_s.allFinite() || !std::isfinite(wish.yaw_rate_rad_s)) {
    trouble.reason = "wished velocity is not a number: stopping";
    return result;
  }
  result.walk = wish.walk;
  for (std::size_t i = 0; i < 2; ++i) {
    if (!wish.landing[i]) continue;
    if (finite(*wish.landing[i]))
      result.landing[i] = wish.landing[i];
    else
      trouble.reason = "wished landing is not a number: left out";
  }
  if (!wish.walk) return result;
  result.velocity_m_s = {
      clamp_to(wish.velocity_m_s.x(), settings_.most_forward_m_s, trouble.clipped),
      clamp_to(wish.velocity_m_s.y(), settings_.most_sideways_m_s, trouble.clipped)};
  result.yaw_rate_rad_s = clamp_to(wish.yaw_rate_rad_s, settings_.most_turn_rad_s, trouble.clipped);
  const double share = fastest_share(result.velocity_m_s, result.yaw_rate_rad_s);
  trouble.clipped = trouble.clipped || share < 1.0;
  result.velocity_m_s *= share;
  return result;
}

}  // namespace mimesis::walker
