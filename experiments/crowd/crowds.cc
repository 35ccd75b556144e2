#include "experiments/crowd/crowds.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace mimesis::crowd {
namespace {

SpeedFunction gait() {
  const std::vector<double> cosine{0.02, 0.05}, sine{0.01, -0.03};
  return {0.22, cosine, sine};
}

}  // namespace

std::vector<double> uniform(int n, double least, double most, std::mt19937_64& draw) {
  std::uniform_real_distribution<double> of(least, most);
  std::vector<double> out;
  for (int i = 0; i < n; ++i) out.push_back(of(draw));
  return out;
}

Crowd one_group(const GroupSettings& group, std::span<const Agent> agents, double dt_s) {
  Crowd crowd({.dt_s = dt_s});
  crowd.add_group(group);
  crowd.add(0, agents);
  return crowd;
}

Crowd one_group(const Rules& rules, std::span<const double> phi_rad, double dt_s) {
  std::vector<Agent> agents;
  for (const double phi : phi_rad) {
    agents.push_back({.id = agents.size() + 1});
    agents.back().state.phase_rad = phi;
    agents.back().traits.omega_rad_s = kOmega_rad_s;
  }
  return one_group({rules, gait_of(0.0), {}}, agents, dt_s);
}

SpeedFunction gait_of(double amplitude) {
  const std::array cosine{0.0, amplitude * kMean_m_rad};
  return {kMean_m_rad, cosine, {}};
}

Crowd tied_crowd(const FrequencyRule& rule, const SpeedFunction& gait,
                 std::span<const double> place_m, std::span<const double> phi_rad, double dt_s) {
  std::vector<Agent> agents(phi_rad.size());
  for (std::size_t i = 0; i < agents.size(); ++i) {
    agents[i].id = i + 1;
    agents[i].state.phase_rad = phi_rad[i];
    agents[i].state.position_W_m.x() = gait.integral(phi_rad[i]) + place_m[i];
    agents[i].traits.place_m = place_m[i];
    agents[i].traits.omega_rad_s = kOmega_rad_s;
  }
  return one_group({Rules{.frequency = rule}, gait, {}}, agents, dt_s);
}

double formation_error_m(const Crowd& crowd) {
  std::vector<double> off(static_cast<std::size_t>(crowd.size()));
  crowd.spacing(0, off);
  const auto [least, most] = std::ranges::minmax(off);
  return most - least;
}

Crowd crossing_crowd(int n) {
  Crowd crowd({.dt_s = 1.0 / 60.0});
  const double side = std::sqrt(n / 0.25);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const bool north : {false, true}) {
    Rules rules;
    rules.frequency = {{Topology::all_to_all}, 0.2 / n, 2.0};
    rules.length = {{Topology::all_to_all}, 0.2 / n, 0.3};
    rules.phase = {{Topology::all_to_all}, 1.0 / n};
    rules.heading = {.kind = HeadingKind::lane, .avoid = true};
    const Path path{{0.0, 0.0}, north ? std::numbers::pi / 2 : 0.0};
    const int group = crowd.add_group({rules, gait(), path});
    std::vector<Agent> all;
    const int columns = static_cast<int>(std::sqrt(n));
    for (int i = north ? 1 : 0; i < n; i += 2) {
      Agent a{.id = static_cast<AgentId>(i + 1)};
      a.traits.omega_rad_s = 5.7 + 0.6 * unit(random);
      const Eigen::Vector2d p((i % columns + 0.6 * unit(random)) * side / columns,
                              (i / columns + 0.6 * unit(random)) * side / columns);
      a.state.position_W_m = p;
      a.state.heading_rad = path.direction_rad;
      a.state.phase_rad = 6.0 * unit(random);
      a.traits.place_m = north ? p.y() : p.x();
      a.traits.lane_m = north ? -p.x() : p.y();
      all.push_back(a);
    }
    crowd.add(group, all);
  }
  return crowd;
}

Crowd circle_crowd(int n) {
  Crowd crowd({.dt_s = 1.0 / 60.0});
  Rules rules;
  rules.phase = {{Topology::all_to_all}, 1.0 / n};
  rules.heading = {.kind = HeadingKind::goal, .avoid = true};
  crowd.add_group({rules, gait(), {}});
  std::vector<Agent> all;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < n; ++i) {
    const double r = std::sqrt((i + 0.5) / (0.25 * std::numbers::pi));
    Agent a{.id = static_cast<AgentId>(i + 1)};
    a.traits.omega_rad_s = 6.0;
    a.state.position_W_m = r * Eigen::Vector2d(std::cos(golden * i), std::sin(golden * i));
    a.traits.goal_W_m = -a.state.position_W_m;
    a.state.heading_rad = std::remainder(golden * i + std::numbers::pi, 2.0 * std::numbers::pi);
    all.push_back(a);
  }
  crowd.add(0, all);
  return crowd;
}

Crowd formation_crowd(int n) {
  Crowd crowd({.dt_s = 1.0 / 60.0});
  Rules rules;
  rules.frequency = {{Topology::all_to_all}, 0.5 / n};
  rules.length = {{Topology::all_to_all}, 0.1 / n};
  rules.phase = {{Topology::all_to_all}, 1.0 / n};
  crowd.add_group({rules, gait(), {}});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Agent> all(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    Agent& a = all[static_cast<std::size_t>(i)];
    a.id = static_cast<AgentId>(i + 1);
    a.traits.omega_rad_s = 6.0;
    a.traits.place_m = -(i % 1000);
    a.state.position_W_m = {a.traits.place_m + unit(random), i / 1000.0};
    a.state.phase_rad = unit(random);
  }
  crowd.add(0, all);
  return crowd;
}

namespace {

Rules to_goals() {
  Rules rules;
  rules.heading = {.kind = HeadingKind::goal, .avoid = true};
  return rules;
}

Agent walker(int id, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  Agent a{.id = static_cast<AgentId>(id)};
  a.traits.omega_rad_s = 6.0;
  a.traits.goal_W_m = to;
  a.state.position_W_m = from;
  const Eigen::Vector2d way = to - from;
  a.state.heading_rad = std::atan2(way.y(), way.x());
  a.state.phase_rad = std::fmod(0.37 * id, 6.0);
  return a;
}

}  // namespace

Crowd ring_crowd(int n) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group({to_goals(), gait(), {}});
  std::vector<Agent> all;
  for (int i = 0; i < n; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / n;
    const Eigen::Vector2d p = 40.0 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    all.push_back(walker(i + 1, p, -p));
  }
  crowd.add(0, all);
  return crowd;
}

Crowd head_on_crowd(int pairs) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group({to_goals(), gait(), {}});
  std::vector<Agent> all;
  for (int i = 0; i < pairs; ++i) {
    const Eigen::Vector2d a(0.0, 20.0 * i), b(10.0, 20.0 * i);
    all.push_back(walker(2 * i + 1, a, b));
    all.push_back(walker(2 * i + 2, b, a));
  }
  crowd.add(0, all);
  return crowd;
}

int arrived(const Crowd& crowd, double within_m) {
  int count = 0;
  for (int row = 0; row < crowd.size(); ++row) {
    const Agent a = crowd.agent(row);
    count += (a.state.position_W_m - a.traits.goal_W_m).norm() < within_m ? 1 : 0;
  }
  return count;
}

}  // namespace mimesis::crowd
