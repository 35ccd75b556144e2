#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

/// State of an agent at time 0.
struct AgentStart {
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0;  ///< in W, (-π, π]
  double phase_rad = 0.0;    ///< [0, 2π)
  double eigenfrequency_rad_s = 0.0;
};

/// Place of an agent in its formation: dᵢ ahead of agents with d = 0, ξᵢ to the left of the path.
struct FormationPlace {
  double place_m = 0.0;
  double lane_m = 0.0;
};

/// How the group begins. Same seed, same bits; agents drawn one after the other, so that a larger
/// group begins like a smaller one unless its grid is wider.
/// @param eigenfrequency_rad_s  ω₀ of the group's gait
/// @throws ConfigError if a box is too small for its agents
std::vector<AgentStart> starts(const Group& group, double eigenfrequency_rad_s, std::uint64_t seed);

/// Places of the group's agents; zeros for Shape::none. Distances of pairs are summed along a tree
/// from agent 0, whose place is 0. @throws ConfigError for distances that are inconsistent or leave
/// an agent without a place
std::vector<FormationPlace> places(const Group& group);

/// First goal of each agent in W [m]; empty for Aim::none.
std::vector<Eigen::Vector2d> first_goals(const Group& group, const std::vector<AgentStart>& from);

/// A point of the path's frame P in W.
Eigen::Vector2d in_world(const Group& group, double z_m, double lane_m);

}  // namespace mimesis::crowd
