#pragma once
#include <string>

#include "nodes/cognition/architecture.h"

namespace mimesis::cognition {

/// The shipped ladder of M18 fig. 2.2, in models/.
inline constexpr const char* kBridgeLadder = "bridge_ladder.yaml";

/// Reads an architecture. `field:` of the file holds constants that all fields share. A file that
/// ends in .json or .dnf is one of dnf-composer (composer_node.h).
/// @throws ConfigError "file:line:col: ..." for an unknown key or a bad value. What only shows when
/// the fields run (an unknown field, an unstable gain) Ladder refuses, with the same place.
Architecture load_architecture(const std::string& file = kBridgeLadder);

}  // namespace mimesis::cognition
