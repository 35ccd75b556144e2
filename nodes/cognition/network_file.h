#pragma once
#include <string>

#include "nodes/cognition/network_spec.h"

namespace mimesis::cognition {

/// The shipped network of M18 fig. 2.2, in models/.
inline constexpr const char* kBarFields = "bar_fields.yaml";

/// Reads a network. `field:` of the file holds constants that all fields share.
/// @throws ConfigError "file:line:col: ..." for an unknown key or a bad value. What only shows when
/// the fields run (an unknown field, an unstable gain) FieldNetwork refuses, with the same place.
NetworkSpec load_network(const std::string& file = kBarFields);

}  // namespace mimesis::cognition
