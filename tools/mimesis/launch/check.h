#pragma once
#include "tools/mimesis/launch/command.h"

namespace mimesis::launch {

/// Finds the mistakes of a launch file: programs, hosts and CPUs that do not exist, and, from what
/// the nodes of this machine say of themselves (--describe), ports, topics, message types, inputs
/// left out, simulated buses with one end, fields of `result:`, parameters.
/// @param whole  every node is made without sockets and devices (--check), so that it finds all
///               that it would refuse; else it tells its ports, which takes milliseconds
void check_graph(const GraphFile& graph, const Run& run, bool whole, Mistakes& mistakes);

}  // namespace mimesis::launch
