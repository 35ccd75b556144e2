#pragma once
#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

#include "nodes/crowd/certificate/monitor.h"
#include "nodes/crowd/engine/agent.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

/// An agent as others see it, wherever it is moved.
struct Observed {
  AgentId id = 0;
  int group = 0;
  bool coupled = true;    ///< takes part in its group's rules
  bool external = false;  ///< another process moves it
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0, phase_rad = 0.0;
  double place_m = 0.0, lane_m = 0.0, radius_m = 0.25;
  Eigen::Vector2d goal_W_m = Eigen::Vector2d::Zero();
  /// What avoidance adds to its ψ̇; not known of who is moved elsewhere.
  double avoid_rad_s = std::numeric_limits<double>::quiet_NaN();
};

/// How far a group is from what its rules are for.
struct GroupOrder {
  int agents = 0;
  GroupErrors errors{};
  double phase_most_rad = 0.0;  ///< largest deviation from the circular mean, of followers
  double place_most_m = 0.0;    ///< farthest from its place; across only if headings keep lanes
  double goal_most_m = 0.0;     ///< farthest from its goal
};

/// Measures groups; keeps its memory.
class Observer {
 public:
  /// @param rules   that the group has at the moment
  /// @param agents  those of the group that are coupled, by id
  /// @param beat_rad  phase of the leader if it is no agent
  GroupOrder measure(const Group& group, const Rules& rules, std::span<const Observed> agents,
                     std::optional<double> beat_rad);

 private:
  std::vector<double> phases_, headings_;
};

/// What a group has to reach by its rules.
struct Wanted {
  bool phases = false, leader = false, places = false, headings = false, goals = false;
};
/// @param passes  agents come and go through zones: it is never to be in order as a whole
Wanted wanted_of(const Group& group, const Rules& rules, bool passes);

/// Angles within this are equal.
inline constexpr double kInOrder_rad = 0.02;
bool in_order(const Group& group, const Wanted& wanted, const GroupOrder& order, double formed_m);

}  // namespace mimesis::crowd
