#include "nodes/crowd/run/scenario_run.h"

#include <algorithm>
#include <string>

#include "common/error.h"

namespace mimesis::crowd {
namespace {

/// The scenario, if it can run.
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

bool along_a_graph(const Rules& rules) {
  const auto sparse = [](const GraphSettings& graph) {
    return graph.topology != Topology::none && graph.topology != Topology::all_to_all;
  };
  return sparse(rules.frequency.graph) || sparse(rules.length.graph) || sparse(rules.phase.graph) ||
         sparse(rules.heading.graph);
}

}  // namespace

ScenarioRun::ScenarioRun(const Scenario& scenario, const Mine& mine)
    : scenario_(sound(scenario)), roster_(scenario_), crowd_({.dt_s = scenario_.step_s}) {
  beat_from_rad_ = scenario_.beat.phase_rad;
  for (const Group& group : scenario_.groups) add_group(group);
  outside_.resize(scenario_.groups.size());
  std::vector<Pillar> pillars;
  for (const PillarSpec& p : scenario_.pillars) pillars.push_back({{p.x_m, p.y_m}, p.radius_m});
  std::vector<Wall> walls;
  for (const WallSpec& w : scenario_.walls) {
    walls.push_back({{w.from_x_m, w.from_y_m}, {w.to_x_m, w.to_y_m}});
  }
  crowd_.set_obstacles(pillars, walls);
  populate(mine);
  hear_beat();
}

void ScenarioRun::add_group(const Group& group) {
  const Gait& gait = *scenario_.gait(group.gait);
  crowd_.add_group({.rules = heard(group.rules, group.beat_gain_1_s),
                    .gait = gait.speed(),
                    .path = {.origin_W_m = {group.origin_x_m, group.origin_y_m},
                             .direction_rad = group.heading_rad},
                    .sway = gait.sway()});
  gaits_.push_back(scenario_.gait_number(group.gait));
  omega_.push_back(gait.eigenfrequency_rad_s);
  bool whole = along_a_graph(group.rules);
  for (const Change& change : scenario_.schedule) {
    whole = whole || (change.group == group.name && along_a_graph(change.rules));
  }
  whole_.push_back(whole);
}

void ScenarioRun::populate(const Mine& mine) {
  std::vector<std::vector<Agent>> members(scenario_.groups.size());
  for (AgentId id = 1; id <= static_cast<AgentId>(roster_.agents()); ++id) {
    Agent agent = roster_.start(id);
    const int home = roster_.home(id);
    const bool ours = mine(agent.state.position_W_m);
    if (!ours && !whole(home)) continue;
    agent.role = ours ? Role::own : Role::mirror;
    members[static_cast<std::size_t>(home)].push_back(agent);
    if (ours) courses_[id] = {};
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

void ScenarioRun::set_outside(int group, const GroupSums& sums) {
  outside_[static_cast<std::size_t>(group)] = sums;
}

void ScenarioRun::step(parallel::Team* team) {
  switches_.clear();
  changed_.clear();
  follow_schedule();
  follow_goals();
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
    const bool here = agent->role == Role::own || agent->role == Role::external;
    if (here && gait(from) != scenario_.gait_number(name)) move(id, from, to);
  }
  return {};
}

void ScenarioRun::hear_beat() {
  if (const std::optional<double> phase = beat_of_agent()) {
    beat_from_rad_ = *phase;
    beat_from_s_ = time_s();
  }
  for (std::size_t g = 0; g < outside_.size(); ++g) {
    GroupSums sums = outside_[g];
    if (scenario_.groups[g].beat_gain_1_s > 0.0) {
      sums.leader = Roster::kBeat;
      sums.leader_phase_rad = beat_rad();
    }
    crowd_.set_outside(static_cast<int>(g), sums);
  }
}

void ScenarioRun::follow_schedule() {
  while (next_change_ < scenario_.schedule.size() &&
         time_s() >= scenario_.schedule[next_change_].at_s) {
    const Change& change = scenario_.schedule[next_change_++];
    const int g = scenario_.group_number(change.group);
    crowd_.set_rules(
        g, heard(change.rules, scenario_.groups[static_cast<std::size_t>(g)].beat_gain_1_s));
    if (!change.gait.empty()) set_gait(g, change.gait);
    changed_.push_back(g);
  }
}

/// Who differed from the old eigenfrequency differs as much from the new one.
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

/// Who cannot join stays where it is: gains may be too large for one more.
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

std::optional<Traveller> ScenarioRun::release(AgentId id) {
  const std::optional<Agent> agent = crowd_.find(id);
  if (!agent || agent->role != Role::own) return std::nullopt;
  Traveller traveller{.agent = *agent, .group = *crowd_.group_of(id)};
  const Course& course = courses_[id];
  traveller.leg = course.leg;
  traveller.waiting = course.waiting;
  if (course.waiting) traveller.agent.traits.stride = course.stride;
  courses_.erase(id);
  MIMESIS_ASSERT(crowd_.set_role(id, Role::mirror));
  return traveller;
}

void ScenarioRun::admit(const Traveller& traveller) {
  const AgentId id = traveller.agent.id;
  const std::optional<int> here = crowd_.group_of(id);
  if (here && *here != traveller.group) crowd_.remove(id);
  if (here && *here == traveller.group) {  // keeps the turn that its phase is in
    MIMESIS_ASSERT(crowd_.set_state(id, traveller.agent.state));
    MIMESIS_ASSERT(crowd_.set_traits(id, traveller.agent.traits));
    MIMESIS_ASSERT(crowd_.set_role(id, Role::own));
  } else {
    crowd_.add(traveller.group, std::span<const Agent>(&traveller.agent, 1));
  }
  Course& course = courses_[id] = {};
  course.leg = traveller.leg;
  if (traveller.waiting) wait(id, true);
}

}  // namespace mimesis::crowd
