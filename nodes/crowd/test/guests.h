#pragma once
#include <cstdint>
#include <string>

#include "proto/crowd.pb.h"

namespace mimesis::crowd::testing {

inline constexpr std::uint64_t kRobot = 5;  ///< the agent after the four of the square

/// Four agents that walk in a square, and a robot of their group in another process. `more`
/// continues the list of externals.
inline std::string square_with_robot(const std::string& name, const std::string& stale_s,
                                     const std::string& more_groups = "",
                                     const std::string& more = "") {
  return "name: " + name + "\nuntil_s: 1000\nstale_s: " + stale_s + R"(
groups:
  - name: square
    count: 4
    gait: walk
    start: {columns: 2}
    rules:
      phase: {graph: all_to_all, gain_1_s: 0.2}
)" + more_groups +
         "externals:\n  - {name: robot, group: square}\n" + more;
}

/// Report of a robot after `t_s` beside the others at their speed, from `x_m` and a phase on.
inline v1::CrowdStates robot_beside(double t_s, double phase_rad, double x_m = 0.0) {
  v1::CrowdStates s;
  s.add_id(kRobot);
  s.add_position_in_world_m(x_m + 1.2 * t_s);
  s.add_position_in_world_m(8.0);
  s.add_velocity_in_world_m_s(1.2F);
  s.add_velocity_in_world_m_s(0.0F);
  s.add_heading_rad(0.0);
  s.add_phase_rad(phase_rad + 5.7 * t_s);
  s.add_phase_rate_rad_s(5.7);
  return s;
}

}  // namespace mimesis::crowd::testing
