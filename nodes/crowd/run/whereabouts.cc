// Where agents are decides what they do next: routes, zones, encounters.
#include <algorithm>
#include <cmath>

#include "common/error.h"
#include "nodes/crowd/run/scenario_run.h"

namespace mimesis::crowd {
namespace {

constexpr double kOnTheSpot = 1e-3;  // of the stride of who waits

bool inside(const Zone& zone, const Eigen::Vector2d& p) {
  return p.x() >= zone.least_x_m && p.x() <= zone.most_x_m && p.y() >= zone.least_y_m &&
         p.y() <= zone.most_y_m;
}

Eigen::Vector2d point(const std::vector<double>& xy, int i) {
  const auto k = 2 * static_cast<std::size_t>(i);
  return {xy[k], xy[k + 1]};
}

}  // namespace

/// Ours, or an external agent that we look after.
bool ScenarioRun::moved_here(int row) const {
  const Role role = crowd_.roles()[static_cast<std::size_t>(row)];
  return role == Role::own || role == Role::external;
}

/// Along routes: who is near its goal gets the next one.
void ScenarioRun::follow_goals() {
  for (std::size_t g = 0; g < scenario_.groups.size(); ++g) {
    const Goals& goals = scenario_.groups[g].goals;
    if (goals.aim != Aim::route) continue;
    const int legs = static_cast<int>(goals.position_m.size() / 2);
    const Crowd::Rows rows = crowd_.rows(static_cast<int>(g));
    for (int row = rows.first; row < rows.first + rows.count; ++row) {
      const auto r = static_cast<std::size_t>(row);
      if (crowd_.roles()[r] != Role::own) continue;
      const AgentId id = crowd_.ids()[r];
      Course& course = courses_[id];
      const Eigen::Vector2d p(crowd_.x_m()[r], crowd_.y_m()[r]);
      if ((p - point(goals.position_m, course.leg)).norm() > goals.reached_m) continue;
      const int next = course.leg + 1 < legs ? course.leg + 1 : goals.loop ? 0 : course.leg;
      if (next == course.leg) continue;
      course.leg = next;
      set_goal(id, point(goals.position_m, next));
    }
  }
}

void ScenarioRun::set_goal(AgentId id, const Eigen::Vector2d& goal) {
  AgentTraits traits = crowd_.find(id)->traits;
  traits.goal_W_m = goal;
  MIMESIS_ASSERT(crowd_.set_traits(id, traits));
}

void ScenarioRun::follow_zones() {
  for (const Zone& zone : scenario_.zones) {
    const int only = zone.from.empty() ? -1 : scenario_.group_number(zone.from),
              to = scenario_.group_number(zone.to);
    for (int g = 0; g < crowd_.groups(); ++g) {
      if (g != to && (only < 0 || g == only)) gather(zone, g);
    }
  }
}

/// Those of one group who are in the zone: they go over, or wait until they are enough.
void ScenarioRun::gather(const Zone& zone, int from) {
  const Crowd::Rows rows = crowd_.rows(from);
  const auto here = [&](int row) {
    const auto r = static_cast<std::size_t>(row);
    return inside(zone, {crowd_.x_m()[r], crowd_.y_m()[r]});
  };
  int arrived = 0;
  if (zone.gather > 1) {
    for (int row = rows.first; row < rows.first + rows.count; ++row) arrived += here(row) ? 1 : 0;
  }
  const bool enough = zone.gather <= 1 || arrived >= zone.gather;
  for (int row = rows.first; row < rows.first + rows.count; ++row) {
    const auto r = static_cast<std::size_t>(row);
    if (!moved_here(row) || !here(row)) continue;
    const AgentId id = crowd_.ids()[r];
    if (crowd_.roles()[r] == Role::own) wait(id, !enough);
    if (enough) plan_switch(id, from, scenario_.group_number(zone.to));
  }
}

void ScenarioRun::wait(AgentId id, bool on) {
  Course& course = courses_[id];
  if (course.waiting == on) return;
  AgentTraits traits = crowd_.find(id)->traits;
  if (on) course.stride = traits.stride;
  course.waiting = on;
  traits.stride = on ? kOnTheSpot * course.stride : course.stride;
  MIMESIS_ASSERT(crowd_.set_traits(id, traits));
}

void ScenarioRun::follow_encounters() {
  for (const Encounter& encounter : scenario_.encounters) meet(encounter);
}

void ScenarioRun::meet(const Encounter& encounter) {
  const int from = scenario_.group_number(encounter.group),
            other = scenario_.group_number(encounter.other),
            to = scenario_.group_number(encounter.to);
  const Crowd::Rows others = crowd_.rows(other), rows = crowd_.rows(from);
  if (others.count == 0 || rows.count == 0) return;
  by_x_.clear();
  for (int row = others.first; row < others.first + others.count; ++row) {
    by_x_.emplace_back(crowd_.x_m()[static_cast<std::size_t>(row)], row);
  }
  std::ranges::sort(by_x_);
  for (int row = rows.first; row < rows.first + rows.count; ++row) {
    const auto r = static_cast<std::size_t>(row);
    if (!moved_here(row)) continue;
    const double x = crowd_.x_m()[r], y = crowd_.y_m()[r], near = encounter.within_m;
    auto k = std::ranges::lower_bound(by_x_, std::pair(x - near, 0));
    for (; k != by_x_.end() && k->first <= x + near; ++k) {
      const auto o = static_cast<std::size_t>(k->second);
      if (o == r || std::hypot(k->first - x, crowd_.y_m()[o] - y) > near) continue;
      plan_switch(crowd_.ids()[r], from, to);
      break;
    }
  }
}

/// The first wish of a step counts.
void ScenarioRun::plan_switch(AgentId id, int from, int to) {
  if (std::ranges::find(switches_, id, &Switch::id) == switches_.end()) {
    switches_.push_back({id, from, to});
  }
}

/// Goals of the new group count, if it has any; else an agent keeps its own.
void ScenarioRun::send_on(Agent& agent, int from, int to) {
  agent.traits.omega_rad_s +=
      omega_[static_cast<std::size_t>(to)] - omega_[static_cast<std::size_t>(from)];
  const Goals& goals = scenario_.groups[static_cast<std::size_t>(to)].goals;
  const bool common =
      goals.aim == Aim::route || (goals.aim == Aim::places && goals.position_m.size() == 2);
  if (!common) return;
  courses_[agent.id].leg = 0;
  agent.traits.goal_W_m = point(goals.position_m, 0);
}

Traveller ScenarioRun::traveller(AgentId id, int group, const AgentState& state) const {
  Traveller traveller{.agent = roster_.start(id), .group = group};
  traveller.agent.role = Role::own;
  traveller.agent.state = state;
  const Group& home = scenario_.groups[static_cast<std::size_t>(roster_.home(id))];
  traveller.agent.traits.omega_rad_s +=
      omega_[static_cast<std::size_t>(group)] - scenario_.gait(home.gait)->eigenfrequency_rad_s;
  const Goals& goals = scenario_.groups[static_cast<std::size_t>(group)].goals;
  if (goals.aim == Aim::route) traveller.agent.traits.goal_W_m = point(goals.position_m, 0);
  return traveller;
}

}  // namespace mimesis::crowd
