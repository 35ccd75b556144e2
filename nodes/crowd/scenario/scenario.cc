#include "nodes/crowd/scenario/scenario.h"

#include <algorithm>

namespace mimesis::crowd {

int Scenario::gait_number(std::string_view wanted) const {
  const auto it = std::ranges::find(gaits, wanted, &Gait::name);
  return it == gaits.end() ? -1 : static_cast<int>(it - gaits.begin());
}

int Scenario::group_number(std::string_view wanted) const {
  const auto it = std::ranges::find(groups, wanted, &Group::name);
  return it == groups.end() ? -1 : static_cast<int>(it - groups.begin());
}

const Gait* Scenario::gait(std::string_view wanted) const {
  const int i = gait_number(wanted);
  return i < 0 ? nullptr : &gaits[static_cast<std::size_t>(i)];
}

const Group* Scenario::group(std::string_view wanted) const {
  const int i = group_number(wanted);
  return i < 0 ? nullptr : &groups[static_cast<std::size_t>(i)];
}

bool Scenario::grows(std::string_view wanted) const {
  return std::ranges::find(zones, wanted, &Zone::to) != zones.end() ||
         std::ranges::find(encounters, wanted, &Encounter::to) != encounters.end() ||
         std::ranges::find(externals, wanted, &External::group) != externals.end();
}

CouplingGraph coupling(const GraphSettings& settings, int n) {
  return settings.topology == Topology::weighted ? CouplingGraph::weighted(n, settings.edges)
                                                 : CouplingGraph::make(settings.topology, n);
}

}  // namespace mimesis::crowd
