#pragma once
#include <string>

#include "nodes/cognition/field_network.h"
#include "nodes/cognition/imitator.h"
#include "nodes/cognition/network_spec.h"

namespace mimesis::cognition {

/// The shipped network of M18 fig. 2.2, in models/.
inline constexpr const char* kBarFields = "bar_fields.yaml";

/// Reads a network. `field:` of the file holds constants that all fields share.
/// @throws ConfigError "file:line:col: ..." for an unknown key or a bad value. What only shows when
/// the fields run (an unknown field, an unstable gain) FieldNetwork refuses, with the same place.
NetworkSpec load_network(const std::string& file = kBarFields);

/// What a robot has learned from success, kept in a file (JSON, version 2):
///
///   {"format": "mimesis-links", "version": 2, "fields": {"PF": {"neurons": 128, "dx": 1.0, ...},
///   ...},
///    "links": {"PF->PFC": [[source, first target, weight, weight, ...], ...], "PFC->PF": ...,
///    ...}}
///
/// Weights only mean something between fields of the constants with which they were learned, so
/// these are kept beside them. With a field of bundles, "bundles": [{"motions": 3, "postures":
/// [[joint, ...], ...]}, ...] tells whose its sites are [rad].

/// The content of a file.
std::string links_text(const FieldNetwork<float>& network, const Bundles& bundles = {0, 0.0});

/// Replaces the file. Why it failed; empty if it did not.
[[nodiscard]] std::string save_links(const std::string& path, const std::string& text);

/// Replaces all learned links of the network by those of the file; every weight keeps its bits.
/// @throws ConfigError if the file is no such file, or of another version or network
void load_links(const std::string& path, FieldNetwork<float>& network, Bundles* bundles = nullptr);

}  // namespace mimesis::cognition
