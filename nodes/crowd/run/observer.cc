#include "nodes/crowd/run/observer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "common/math/circle.h"
#include "nodes/crowd/rules/synchrony.h"

namespace mimesis::crowd {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

void measure_places(const Group& group, bool lanes, std::span<const Observed> agents,
                    GroupOrder& order) {
  const Eigen::Vector2d origin(group.origin_x_m, group.origin_y_m);
  const Eigen::Vector2d ahead(std::cos(group.heading_rad), std::sin(group.heading_rad));
  const Eigen::Vector2d left(-ahead.y(), ahead.x());
  const auto error = [&](const Observed& a) { return (a.p_W_m - origin).dot(ahead) - a.place_m; };
  double mean = 0.0, least = error(agents[0]), most = least;
  for (const Observed& a : agents) {
    mean += error(a) / static_cast<double>(agents.size());
    least = std::min(least, error(a));
    most = std::max(most, error(a));
  }
  order.errors.spacing_m = most - least;
  for (const Observed& a : agents) {
    const double across = lanes ? (a.p_W_m - origin).dot(left) - a.lane_m : 0.0;
    order.place_most_m = std::max(order.place_most_m, std::hypot(error(a) - mean, across));
  }
}

/// Largest distance of a heading from that which the rule is for; of those who are at their goals
/// there is none.
double heading_error(const Group& group, HeadingKind kind, std::span<const double> headings,
                     std::span<const Observed> agents) {
  if (kind == HeadingKind::consensus || kind == HeadingKind::coupled) return spread(headings);
  if (kind == HeadingKind::keep) return kNan;
  double most = 0.0;
  for (const Observed& a : agents) {
    const Eigen::Vector2d way = a.goal_W_m - a.p_W_m;
    if (kind == HeadingKind::goal && way.norm() <= group.goals.reached_m) continue;
    const double wished =
        kind == HeadingKind::lane ? group.heading_rad : std::atan2(way.y(), way.x());
    most = std::max(most, std::abs(math::wrap_pi(a.heading_rad - wished)));
  }
  return most;
}

}  // namespace

GroupOrder Observer::measure(const Group& group, const Rules& rules,
                             std::span<const Observed> agents, std::optional<double> beat_rad) {
  GroupOrder order;
  order.agents = static_cast<int>(agents.size());
  order.errors = {kNan, kNan, kNan, kNan};
  if (agents.empty()) return order;
  phases_.clear();
  headings_.clear();
  for (const Observed& a : agents) {
    phases_.push_back(a.phase_rad);
    headings_.push_back(a.heading_rad);
  }
  const bool led = rules.phase.leader_gain_1_s > 0.0, by_agent = led && !beat_rad;
  const std::span followers = std::span<const double>(phases_).subspan(by_agent ? 1 : 0);
  order.errors.dispersion = dispersion(followers);
  order.phase_most_rad = followers.empty() ? 0.0 : spread(followers);
  if (led) {
    const double leader = beat_rad.value_or(phases_[0]);
    order.errors.tracking_rad = 0.0;
    for (const double phase : followers) {
      order.errors.tracking_rad =
          std::max(order.errors.tracking_rad, std::abs(math::wrap_pi(phase - leader)));
    }
  }
  order.errors.heading_rad = heading_error(group, rules.heading.kind, headings_, agents);
  measure_places(group, rules.heading.kind == HeadingKind::lane, agents, order);
  for (const Observed& a : agents) {
    order.goal_most_m = std::max(order.goal_most_m, (a.goal_W_m - a.p_W_m).norm());
  }
  return order;
}

Wanted wanted_of(const Group& group, const Rules& rules, bool passes) {
  if (passes) return {};
  const bool keeps_places = group.formation.shape != Shape::none &&
                            (rules.frequency.gain_rad_m_s != 0.0 || rules.length.gain_1_m != 0.0);
  const HeadingKind heading = rules.heading.kind;
  const bool endless = group.goals.aim == Aim::route && group.goals.loop;
  return {.phases = rules.phase.gain_1_s != 0.0,
          .leader = rules.phase.leader_gain_1_s != 0.0,
          .places = keeps_places,
          .headings = heading == HeadingKind::consensus || heading == HeadingKind::coupled,
          .goals = heading == HeadingKind::goal && group.goals.aim != Aim::none && !endless};
}

bool in_order(const Group& group, const Wanted& wanted, const GroupOrder& order, double formed_m) {
  if (order.agents == 0) return true;
  return (!wanted.phases || order.phase_most_rad <= kInOrder_rad) &&
         (!wanted.leader || order.errors.tracking_rad <= kInOrder_rad) &&
         (!wanted.places || order.place_most_m <= formed_m) &&
         (!wanted.headings || order.errors.heading_rad <= kInOrder_rad) &&
         (!wanted.goals || order.goal_most_m <= group.goals.reached_m);
}

}  // namespace mimesis::crowd
