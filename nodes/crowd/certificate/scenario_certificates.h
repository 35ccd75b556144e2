#pragma once
#include <optional>
#include <string>
#include <vector>

#include "nodes/crowd/certificate/certificate.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

/// A group between two changes of its rules or gait.
struct Stage {
  std::string group, gait;
  double from_s = 0.0;
  Rules rules{};
  int agents = 0;  ///< external ones included
  Certificate certificate{};
  /// Bound on the time to formation from the start [s], of first stages (formation_time_s).
  std::optional<double> formation_s{};
};

/// Certificates of all groups, in the order of groups and time.
/// @pre faults(scenario) is empty
std::vector<Stage> certify(const Scenario& scenario);

/// Largest number of agents that theorem 6, and the weak condition [M18 B.14], allow with a gait.
struct TopologyLimit {
  Topology topology = Topology::none;
  std::optional<int> theorem6{}, weak{};  ///< nothing: any number
};

std::vector<TopologyLimit> topology_limits(const SpeedFunction& gait);

}  // namespace mimesis::crowd
