#pragma once
#include <string>

#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/supervisor.h"

namespace mimesis::launch {

// What `mimesis launch` prints; the JSON shapes are in tools/mimesis/README.md.

/// Mistakes to standard error, or with `json` as an object to standard output.
void report_mistakes(const std::string& file, const Mistakes& mistakes, bool json);

/// Commands in order of start and the order of stopping, to standard output.
void print_plan(const GraphFile& graph, const Run& run, bool json);

std::string summary_json(const Outcome& outcome, const Run& run);

}  // namespace mimesis::launch
