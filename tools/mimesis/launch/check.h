#pragma once
#include "tools/mimesis/launch/command.h"

namespace mimesis::launch {

/// What can be seen without starting a node: programs exist, hosts are declared, inputs are wired
/// to topics that a node of the file can publish, --set names nodes.
void check_graph(const GraphFile& graph, const Run& run, Mistakes& mistakes);

/// Starts every local node with --check, which reads its parameters and exits, and collects what
/// they say.
void check_parameters(const GraphFile& graph, const Run& run, Mistakes& mistakes);

}  // namespace mimesis::launch
