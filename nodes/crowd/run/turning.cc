#include "nodes/crowd/run/turning.h"

#include <cmath>
#include <limits>

#include "common/math/circle.h"

namespace mimesis::crowd {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
// Of the turning by the rule, what avoidance may have. A lane is given up for it but not the way
// back: a constant push shifts the lane and leaves headings as they are.
constexpr double kFreeGoal = 0.05, kFreeLane = 0.1;
constexpr double kNearLane_rad = 0.1;  // where the slow mode is left, that of the lane

}  // namespace

double turn_error(const Group& group, const HeadingRule& rule, const RuleCertificate& certificate,
                  double omega_rad_s, const Observed& agent) {
  const bool to_goal = rule.kind == HeadingKind::goal;
  if (!to_goal && rule.kind != HeadingKind::lane) return kNone;
  const Eigen::Vector2d way = agent.goal_W_m - agent.p_W_m;
  if (to_goal && way.norm() < certificate.beyond_m) return kNone;
  const double wished = to_goal ? std::atan2(way.y(), way.x()) : group.heading_rad;
  const double off = std::abs(math::wrap_pi(agent.heading_rad - wished));
  const double gain_1_s = to_goal ? rule.gain : rule.gain * omega_rad_s;
  const double free = to_goal ? kFreeGoal : kFreeLane;
  if (!(std::abs(agent.avoid_rad_s) <= free * gain_1_s * std::sin(off))) return kNone;  // NaN too
  if (to_goal) return 2.0 * std::tan(0.5 * off);
  return off <= kNearLane_rad ? off : kNone;
}

void measure_turns(Monitor& monitor, const Group& group, const HeadingRule& rule,
                   double omega_rad_s, std::span<const Observed> agents, double t_s) {
  for (const Observed& a : agents) {
    monitor.turn(a.id, t_s, turn_error(group, rule, monitor.certificate().heading, omega_rad_s, a));
  }
}

}  // namespace mimesis::crowd
