#pragma once
#include <string>
#include <vector>

#include "common/runtime/params.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

/// Reads launch/crowd/NAME.yaml; keys are the members of Scenario. `graph` and `edges` of a rule
/// are keys of the rule itself; with edges the graph is weighted.
/// @param sets "KEY=VALUE" replaces a value of the file: "groups.0.count=8"
/// @throws ConfigError with one line "file:line:col: key: what" for every unknown key, bad value
/// and
///         fault of the scenario
Scenario read_scenario(const std::string& file, const std::vector<std::string>& sets = {});

/// A file, as given or in launch/ of the source tree or installation ("crowd/dance.yaml"); a bare
/// word is one of launch/crowd/.
/// @throws ConfigError that names the places searched; for a bare word the scenarios there are
std::string find_scenario(const std::string& name);

/// One visit for reading, listing and dumping. Names of coupling graphs and the like become enums
/// as they are read.
void visit(runtime::ParamVisitor& v, Scenario& scenario);

}  // namespace mimesis::crowd
