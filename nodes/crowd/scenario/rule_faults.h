#pragma once
#include <string>
#include <vector>

#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

/// What `rules` must not be for this group.
/// @param path   of the rules in the scenario, "groups.0.rules"
/// @param grows  agents may join while it runs
void add_rule_faults(const std::string& path, const Rules& rules, const Group& group, bool grows,
                     std::vector<Fault>& faults);

}  // namespace mimesis::crowd
