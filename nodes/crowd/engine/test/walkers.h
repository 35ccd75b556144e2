#pragma once
#include <algorithm>
#include <cmath>
#include <vector>

#include "nodes/crowd/engine/crowd.h"

/// Walkers to goals that avoid each other.
namespace mimesis::crowd {

inline SpeedFunction gait() {
  const std::vector<double> cosine{0.02, 0.05}, sine{0.01, -0.03};
  return {0.22, cosine, sine};
}

inline GroupSettings walkers() {
  Rules rules;
  rules.heading = {.kind = HeadingKind::goal, .gain = 1.0, .avoid = true};
  return {rules, gait(), {}};
}

inline Agent walker(AgentId id, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  Agent a{.id = id};
  a.traits.omega_rad_s = 6.0;
  a.traits.goal_W_m = to;
  a.state.position_W_m = from;
  const Eigen::Vector2d way = to - from;
  a.state.heading_rad = std::atan2(way.y(), way.x());
  a.state.phase_rad = 0.37 * static_cast<double>(id);
  return a;
}

inline double least_distance(const Crowd& c) {
  double least = 1e9;
  for (std::size_t i = 0; i < c.ids().size(); ++i) {
    for (std::size_t j = i + 1; j < c.ids().size(); ++j) {
      least = std::min(least, std::hypot(c.x_m()[i] - c.x_m()[j], c.y_m()[i] - c.y_m()[j]));
    }
  }
  return least;
}

inline int arrived(const Crowd& c, double within_m) {
  int n = 0;
  for (int i = 0; i < c.size(); ++i) {
    const Agent a = c.agent(i);
    n += (a.state.position_W_m - a.traits.goal_W_m).norm() < within_m;
  }
  return n;
}

}  // namespace mimesis::crowd
