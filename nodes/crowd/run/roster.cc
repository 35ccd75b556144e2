#include "nodes/crowd/run/roster.h"

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

}  // namespace mimesis::crowd
