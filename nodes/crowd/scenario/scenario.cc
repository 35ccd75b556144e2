#include "nodes/crowd/scenario/scenario.h"

#include <algorithm>

namespace mimesis::crowd {

const Gait* Scenario::gait(std::string_view wanted) const {
  const auto it = std::ranges::find(gaits, wanted, &Gait::name);
  return it == gaits.end() ? nullptr : &*it;
}

const Group* Scenario::group(std::string_view wanted) const {
  const auto it = std::ranges::find(groups, wanted, &Group::name);
  return it == groups.end() ? nullptr : &*it;
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
