#include "nodes/crowd/run/scenario_run.h"

#include <algorithm>
#include <cmath>

#include "common/error.h"

namespace mimesis::crowd {

Roster::Roster(const Scenario& scenario) {
  for (std::size_t g = 0; g < scenario.groups.size(); ++g) {
    const Group& group = scenario.groups[g];
    const double omega = scenario.gait(group.gait)->eigenfrequency_rad_s;
    const std::vector<AgentStart> from =
        starts(group, omega, static_cast<std::uint64_t>(scenario.seed));
    const std::vector<FormationPlace> to = places(group);
    const std::vector<Eigen::Vector2d> goals = first_goals(group, from);
    for (std::size_t i = 0; i < from.size(); ++i) {
      Agent agent{.id = agents_.size() + 1};
      agent.state.position_W_m = from[i].p_W_m;
      agent.state.heading_rad = from[i].heading_rad;
      agent.state.phase_rad = from[i].phase_rad;
      agent.traits.omega_rad_s = from[i].eigenfrequency_rad_s;
      agent.traits.radius_m = group.radius_m;
      agent.traits.place_m = to[i].place_m;
      agent.traits.lane_m = to[i].lane_m;
      agent.traits.goal_W_m = goals.empty() ? from[i].p_W_m : goals[i];
      agents_.push_back(agent);
      homes_.push_back(static_cast<int>(g));
    }
  }
  first_external_ = agents_.size() + 1;
  for (const External& external : scenario.externals) {
    const int g = scenario.group_number(external.group);
    Agent agent{.id = agents_.size() + 1, .role = Role::external};
    agent.traits.omega_rad_s =
        scenario.gait(scenario.groups[static_cast<std::size_t>(g)].gait)->eigenfrequency_rad_s;
    agent.traits.radius_m = external.radius_m;
    agent.traits.place_m = external.place_m;
    agent.traits.lane_m = external.lane_m;
    agents_.push_back(agent);
    homes_.push_back(g);
  }
}

int Roster::external(AgentId id) const {
  return id >= first_external_ && known(id) ? static_cast<int>(id - first_external_) : -1;
}

namespace {

const Scenario& sound(const Scenario& scenario) {
  const std::vector<Fault> found = faults(scenario);
  if (found.empty()) return scenario;
  throw ConfigError(scenario.name + "." + found[0].path + ": " + found[0].what);
}

/// The beat leads as an agent that is nowhere: α of [M18 eq. 4.26].
Rules heard(Rules rules, double beat_gain_1_s) {
  if (beat_gain_1_s > 0.0) rules.phase.leader_gain_1_s = beat_gain_1_s;
  return rules;
}

constexpr double kLook_s = 0.1, kBehind_m = 0.6;
constexpr double kOnTheSpot = 1e-3;  // share of the stride of an agent that waits

bool inside(const Zone& zone, const Eigen::Vector2d& p) {
  return p.x() >= zone.least_x_m && p.x() <= zone.most_x_m && p.y() >= zone.least_y_m &&
         p.y() <= zone.most_y_m;
}

Eigen::Vector2d point(const std::vector<double>& xy, int i) {
  const auto k = 2 * static_cast<std::size_t>(i);
  return {xy[k], xy[k + 1]};
}

}  // namespace

ScenarioRun::ScenarioRun(const Scenario& scenario)
    : scenario_(sound(scenario)), roster_(scenario_), crowd_({.dt_s = scenario_.step_s}) {
  beat_from_rad_ = scenario_.beat.phase_rad;
  for (const Group& group : scenario_.groups) add_group(group);
  crowd_.set_obstacles(scenario_.pillars, edges(scenario_.walls, scenario_.polygons));
  populate();
  hear_beat();
}

void ScenarioRun::add_group(const Group& group) {
  const Gait& gait = *scenario_.gait(group.gait);
  crowd_.add_group({.rules = heard(group.rules, group.beat_gain_1_s),
                    .gait = gait.speed(),
                    .path = {.origin_W_m = {group.origin_x_m, group.origin_y_m},
                             .direction_rad = group.heading_rad},
                    .sway = gait.sway()});
  const bool plans = plans_ways(scenario_, group);
  ways_.push_back(plans ? std::optional(ways_of(scenario_, group)) : std::nullopt);
  gaits_.push_back(scenario_.gait_number(group.gait));
  omega_.push_back(gait.eigenfrequency_rad_s);
}

void ScenarioRun::populate() {
  std::vector<std::vector<Agent>> members(scenario_.groups.size());
  for (AgentId id = 1; id <= static_cast<AgentId>(roster_.agents()); ++id) {
    members[static_cast<std::size_t>(roster_.home(id))].push_back(roster_.start(id));
    courses_[id] = {.goal_W_m = roster_.start(id).traits.goal_W_m};
  }
  for (std::size_t g = 0; g < members.size(); ++g) crowd_.add(static_cast<int>(g), members[g]);
}

double ScenarioRun::beat_rad() const {
  return beat_of_agent().value_or(beat_from_rad_ +
                                  scenario_.beat.rate_rad_s * (time_s() - beat_from_s_));
}

/// Its phase, while it takes part.
std::optional<double> ScenarioRun::beat_of_agent() const {
  const auto leader = std::ranges::find(scenario_.externals, scenario_.beat.agent, &External::name);
  if (leader == scenario_.externals.end()) return std::nullopt;
  const std::optional<Agent> agent =
      crowd_.find(roster_.external_id(static_cast<int>(leader - scenario_.externals.begin())));
  if (!agent || agent->role != Role::external) return std::nullopt;
  return agent->state.phase_rad;
}

bool ScenarioRun::waiting(AgentId id) const {
  const auto found = courses_.find(id);
  return found != courses_.end() && found->second.waiting;
}

void ScenarioRun::step(parallel::Team* team) {
  switches_.clear();
  changed_.clear();
  follow_schedule();
  follow_goals();
  follow_ways();
  follow_zones();
  follow_encounters();
  make_switches();
  hear_beat();
  crowd_.step(team);
  if (trouble_.empty()) return;
  std::string why;
  why.swap(trouble_);
  throw ConfigError(why);
}

std::string ScenarioRun::wish_gait(std::span<const AgentId> ids, const std::string& name) {
  if (scenario_.gait_number(name) < 0) {
    std::string known;
    for (const Gait& gait : scenario_.gaits) known += (known.empty() ? "" : ", ") + gait.name;
    return "'" + name + "' is none of the scenario's gaits: " + known;
  }
  for (int g = 0; ids.empty() && g < crowd_.groups(); ++g) {
    set_gait(g, name);
    changed_.push_back(g);
  }
  const auto walks_so = std::ranges::find(gaits_, scenario_.gait_number(name));
  if (!ids.empty() && walks_so == gaits_.end()) return "no group walks '" + name + "'";
  for (const AgentId id : ids) {
    const std::optional<Agent> agent = crowd_.find(id);
    if (!agent) return "there is no agent " + std::to_string(id);
    const int from = *crowd_.group_of(id), to = static_cast<int>(walks_so - gaits_.begin());
    if (is_coupled(agent->role) && gait(from) != scenario_.gait_number(name)) move(id, from, to);
  }
  return {};
}

void ScenarioRun::hear_beat() {
  if (const std::optional<double> phase = beat_of_agent()) {
    beat_from_rad_ = *phase;
    beat_from_s_ = time_s();
  }
  for (std::size_t g = 0; g < scenario_.groups.size(); ++g) {
    if (scenario_.groups[g].beat_gain_1_s > 0.0) crowd_.set_beat(static_cast<int>(g), beat_rad());
  }
}

/// A change that the engine refuses is tried again: a group may have too many agents for it now.
void ScenarioRun::follow_schedule() {
  while (next_change_ < scenario_.schedule.size() &&
         time_s() >= scenario_.schedule[next_change_].at_s) {
    const Change& change = scenario_.schedule[next_change_];
    const int g = scenario_.group_number(change.group);
    const Rules before = crowd_.group(g).rules;
    bool ruled = false;
    try {
      crowd_.set_rules(
          g, heard(change.rules, scenario_.groups[static_cast<std::size_t>(g)].beat_gain_1_s));
      ruled = true;
      if (!change.gait.empty()) set_gait(g, change.gait);
    } catch (const ConfigError& e) {
      if (ruled) crowd_.set_rules(g, before);
      trouble_ = "group " + change.group + " keeps its rules: " + e.what();
      return;
    }
    ++next_change_;
    changed_.push_back(g);
  }
}

/// An agent that differed from the old eigenfrequency differs as much from the new one.
void ScenarioRun::set_gait(int g, const std::string& name) {
  const Gait& gait = *scenario_.gait(name);
  crowd_.set_gait(g, gait.speed(), gait.sway());
  gaits_[static_cast<std::size_t>(g)] = scenario_.gait_number(name);
  double& omega = omega_[static_cast<std::size_t>(g)];
  const Crowd::Rows rows = crowd_.rows(g);
  for (int row = rows.first; row < rows.first + rows.count; ++row) {
    Agent agent = crowd_.agent(row);
    agent.traits.omega_rad_s += gait.eigenfrequency_rad_s - omega;
    MIMESIS_ASSERT(crowd_.set_traits(agent.id, agent.traits));
  }
  omega = gait.eigenfrequency_rad_s;
}

void ScenarioRun::make_switches() {
  for (const Switch& s : switches_) move(s.id, s.from, s.to);
}

/// An agent that cannot join stays where it is: gains may be too large for one more.
void ScenarioRun::move(AgentId id, int from, int to) {
  const Agent before = *crowd_.find(id);
  Agent agent = before;
  crowd_.remove(id);
  send_on(agent, from, to);
  try {
    crowd_.add(to, std::span<const Agent>(&agent, 1));
  } catch (const ConfigError& e) {
    crowd_.add(from, std::span<const Agent>(&before, 1));
    trouble_ = "agent " + std::to_string(id) + " stays in group " +
               scenario_.groups[static_cast<std::size_t>(from)].name + ": " + e.what();
  }
}

/// Moved here, or an external agent that takes part.
bool ScenarioRun::takes_part(int row) const {
  return is_coupled(crowd_.roles()[static_cast<std::size_t>(row)]);
}

/// Along routes: an agent near its goal gets the next one.
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

/// Around walls: every tenth of a second each looks for the place where its way bends next. It
/// heads for a place behind that, since walkers arrive at their goals slowly.
void ScenarioRun::follow_ways() {
  const auto every = static_cast<std::uint64_t>(std::max(1.0, kLook_s / scenario_.step_s));
  ++steps_;
  for (int g = 0; g < crowd_.groups(); ++g) {
    std::optional<Ways>& ways = ways_[static_cast<std::size_t>(g)];
    if (!ways || !plans_ways(scenario_, crowd_.group(g).rules)) continue;
    const Crowd::Rows rows = crowd_.rows(g);
    for (int row = rows.first; row < rows.first + rows.count; ++row) {
      const auto r = static_cast<std::size_t>(row);
      const AgentId id = crowd_.ids()[r];
      if (crowd_.roles()[r] != Role::own || (id + steps_) % every != 0) continue;
      const Eigen::Vector2d p(crowd_.x_m()[r], crowd_.y_m()[r]), goal = goal_W_m(id);
      const Eigen::Vector2d next = ways->next(p, goal).value_or(goal);
      const double way = (next - p).norm();
      AgentTraits traits = crowd_.find(id)->traits;
      traits.goal_W_m = next == goal ? goal : p + std::max(1.0, kBehind_m / way) * (next - p);
      MIMESIS_ASSERT(crowd_.set_traits(id, traits));
    }
  }
}

Eigen::Vector2d ScenarioRun::goal_W_m(AgentId id) const {
  const auto found = courses_.find(id);
  return found != courses_.end() ? found->second.goal_W_m : crowd_.find(id)->traits.goal_W_m;
}

void ScenarioRun::set_goal(AgentId id, const Eigen::Vector2d& goal) {
  courses_[id].goal_W_m = goal;
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

/// Agents of one group in the zone go over, or wait until they are enough.
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
    if (!takes_part(row) || !here(row)) continue;
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
    if (!takes_part(row)) continue;
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
  Course& course = courses_[agent.id];
  course.leg = 0;
  course.goal_W_m = agent.traits.goal_W_m = point(goals.position_m, 0);
}

}  // namespace mimesis::crowd
