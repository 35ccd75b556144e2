#pragma once
#include <string>

#include "nodes/cognition/ladder.h"

namespace mimesis::cognition {

/// What a robot has learned, kept in a file (JSON, version 1):
///
///   {"format": "mimesis-links", "version": 1, "fields": {"neurons": 128, "dx": 1.0, ...},
///    "links": {"PF->PFC": [[source, first target, weight, weight, ...], ...], "PFC->PF": ...,
///    ...}}
///
/// Weights only mean something between fields of the constants with which they were learned, so
/// these are kept beside them.

/// Replaces the file. @throws std::runtime_error if it cannot be written
void save_links(const std::string& path, const Ladder<float>& ladder);

/// Replaces all learned links of the ladder by those of the file; every weight keeps its bits.
/// @throws ConfigError if the file is no such file, or of another version or other fields
void load_links(const std::string& path, Ladder<float>& ladder);

}  // namespace mimesis::cognition
