#pragma once
#include <iosfwd>
#include <string>

#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::tool {

/// Prints the guarantees of every group and stage, their rates, the largest N of each kind of
/// graph, and advice. Returns whether every rule in force is guaranteed.
bool print_certificates(const crowd::Scenario& scenario, std::ostream& out, bool colour);

/// Report as one JSON object on a line, see tools/mimesis/README.md.
bool print_certificates_json(const std::string& file, const crowd::Scenario& scenario,
                             std::ostream& out);

}  // namespace mimesis::tool
