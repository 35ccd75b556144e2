#include "nodes/crowd/crowd_messages.h"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "common/math/circle.h"
#include "common/model/drawing.h"

namespace mimesis::crowd {

namespace {

constexpr double kFar_m = 1e6, kFast = 1e3, kTurns_rad = 1e9, kLarge_m = 100.0;

bool within(double value, double most) { return std::abs(value) <= most; }

template <class Values>
bool all_within(const Values& values, double most) {
  for (const auto value : values) {
    if (!within(static_cast<double>(value), most)) return false;
  }
  return true;
}

using model::Rgba;

constexpr std::array<Rgba, 8> kGroups{{{0.20, 0.45, 0.85, 1.0},
                                       {0.90, 0.40, 0.15, 1.0},
                                       {0.20, 0.65, 0.35, 1.0},
                                       {0.65, 0.35, 0.75, 1.0},
                                       {0.85, 0.70, 0.15, 1.0},
                                       {0.15, 0.70, 0.75, 1.0},
                                       {0.85, 0.30, 0.50, 1.0},
                                       {0.45, 0.45, 0.45, 1.0}}};
constexpr Rgba kStone{0.55, 0.52, 0.50, 1.0}, kGoal{0.90, 0.20, 0.20, 0.5};
constexpr double kTall_m = 1.7, kStroke_m = 0.5, kStroke_px = 3.0;
constexpr std::size_t kMostDiscs = 500;

void paint_still(const Scenario& scenario, foxglove::SceneEntity& entity) {
  for (const Pillar& p : scenario.pillars) {
    model::add_rod(entity, {p.position_W_m.x(), p.position_W_m.y(), 0.0},
                   {p.position_W_m.x(), p.position_W_m.y(), kTall_m}, p.radius_m, kStone);
  }
  for (const Wall& w : edges(scenario.walls, scenario.polygons)) {
    model::add_rod(entity, {w.from_W_m.x(), w.from_W_m.y(), 0.1}, {w.to_W_m.x(), w.to_W_m.y(), 0.1},
                   0.05, kStone);
  }
  for (const Group& group : scenario.groups) {
    const std::vector<double>& xy = group.goals.position_m;
    for (std::size_t i = 0; i + 1 < xy.size(); i += 2) {
      model::add_ball(entity, {xy[i], xy[i + 1], 0.05}, 0.15, kGoal);
    }
  }
}

}  // namespace

std::string fault(const v1::CrowdStates& states, const Scenario& scenario) {
  const int n = states.id_size();
  const bool fits = states.position_in_world_m_size() == 2 * n && states.heading_rad_size() == n &&
                    states.velocity_in_world_m_s_size() == 2 * n && states.phase_rad_size() == n &&
                    states.phase_rate_rad_s_size() == n;
  if (!fits) return fmt::format("{} agents, but lists of other lengths", n);
  if (!all_within(states.position_in_world_m(), kFar_m) ||
      !all_within(states.velocity_in_world_m_s(), kFast) ||
      !all_within(states.heading_rad(), kTurns_rad) ||
      !all_within(states.phase_rad(), kTurns_rad) ||
      !all_within(states.phase_rate_rad_s(), kFast)) {
    return "a place, speed, angle or rate that no walker has";
  }
  for (const std::uint32_t group : states.group()) {
    if (group >= scenario.groups.size()) {
      return fmt::format("group {}: there are {}", group, scenario.groups.size());
    }
  }
  return {};
}

void to_proto(const ScenarioRun& run, v1::CrowdStates& states) {
  const Crowd& crowd = run.crowd();
  states.clear_id();
  states.clear_group();
  states.clear_position_in_world_m();
  states.clear_velocity_in_world_m_s();
  states.clear_heading_rad();
  states.clear_phase_rad();
  states.clear_phase_rate_rad_s();
  states.clear_external();
  for (int g = 0; g < crowd.groups(); ++g) {
    const Crowd::Rows rows = crowd.rows(g);
    for (int row = rows.first; row < rows.first + rows.count; ++row) {
      const auto r = static_cast<std::size_t>(row);
      const Role role = crowd.roles()[r];
      const bool external = run.roster().external(crowd.ids()[r]) >= 0;
      states.add_id(crowd.ids()[r]);
      states.add_group(static_cast<std::uint32_t>(g));
      states.add_position_in_world_m(crowd.x_m()[r]);
      states.add_position_in_world_m(crowd.y_m()[r]);
      states.add_velocity_in_world_m_s(crowd.velocity_x_m_s()[r]);
      states.add_velocity_in_world_m_s(crowd.velocity_y_m_s()[r]);
      states.add_heading_rad(crowd.heading_rad()[r]);
      states.add_phase_rad(crowd.phase_rad()[r]);
      const double rate = crowd.phase_rate_rad_s()[r];
      states.add_phase_rate_rad_s(std::isfinite(rate) ? rate : 0.0);
      states.add_external(!external ? 0U : role == Role::external ? 1U : 2U);
    }
  }
}

AgentReport to_report(const v1::CrowdStates& states, int i) {
  const Eigen::Vector2d velocity(static_cast<double>(states.velocity_in_world_m_s(2 * i)),
                                 static_cast<double>(states.velocity_in_world_m_s(2 * i + 1)));
  const double heading = states.heading_rad(i);
  return {.p_W_m = {states.position_in_world_m(2 * i), states.position_in_world_m(2 * i + 1)},
          .heading_rad = heading,
          .phase_rad = states.phase_rad(i),
          .phase_rate_rad_s = states.phase_rate_rad_s(i),
          .speed_m_s = velocity.dot(Eigen::Vector2d(std::cos(heading), std::sin(heading)))};
}

AgentState to_state(const AgentReport& report) {
  AgentState state;
  state.position_W_m = report.p_W_m;
  state.velocity_W_m_s = report.speed_m_s * Eigen::Vector2d(std::cos(report.heading_rad),
                                                            std::sin(report.heading_rad));
  state.heading_rad = math::wrap_pi(report.heading_rad);
  state.phase_rad = report.phase_rad;
  state.phase_rate_rad_s = report.phase_rate_rad_s;
  return state;
}

v1::CrowdInfo to_info(const ScenarioRun& run) {
  const Scenario& scenario = run.scenario();
  v1::CrowdInfo info;
  info.set_scenario(scenario.name);
  info.set_agents(static_cast<std::uint32_t>(run.roster().agents()));
  for (const Group& group : scenario.groups) {
    info.add_groups(group.name);
    info.add_gaits(group.gait);
  }
  for (int e = 0; e < run.roster().externals(); ++e) {
    info.add_external_names(scenario.externals[static_cast<std::size_t>(e)].name);
    info.add_external_ids(run.roster().external_id(e));
  }
  return info;
}

v1::CrowdTrust to_proto(Trust trust) {
  switch (trust) {
    case Trust::trusted:
      return v1::CROWD_TRUST_TRUSTED;
    case Trust::lagging:
      return v1::CROWD_TRUST_LAGGING;
    case Trust::absent:
      break;
  }
  return v1::CROWD_TRUST_ABSENT;
}

foxglove::SceneUpdate paint(const Scenario& scenario, std::span<const Observed> agents,
                            std::chrono::nanoseconds stamp) {
  foxglove::SceneUpdate update;
  paint_still(scenario, model::add_entity(update, "place", "world", stamp));
  for (std::size_t g = 0; g < scenario.groups.size(); ++g) {
    const Rgba& color = kGroups[g % kGroups.size()];
    foxglove::SceneEntity& entity =
        model::add_entity(update, "group/" + scenario.groups[g].name, "world", stamp);
    foxglove::LinePrimitive& strokes =
        model::add_line(entity, foxglove::LinePrimitive::LINE_LIST, kStroke_px, color);
    for (const Observed& agent : agents) {
      if (agent.group != static_cast<int>(g)) continue;
      const Eigen::Vector3d p(agent.p_W_m.x(), agent.p_W_m.y(), 0.0);
      const Eigen::Vector3d ahead(std::cos(agent.heading_rad), std::sin(agent.heading_rad), 0.0);
      model::add_point(strokes, p);
      model::add_point(strokes, p + kStroke_m * ahead);
      if (agents.size() > kMostDiscs) continue;
      model::add_rod(entity, p, p + Eigen::Vector3d(0.0, 0.0, 0.05), scenario.groups[g].radius_m,
                     color);
    }
  }
  return update;
}

}  // namespace mimesis::crowd
