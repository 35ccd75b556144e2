#pragma once
#include <string>
#include <vector>

#include "tools/mimesis/launch/graph_file.h"

namespace mimesis::launch {

/// Notes every `after` that names no node of the file, and every circle of them.
void check_order(const GraphFile& graph, Mistakes& mistakes);

/// Removes nodes with a false `if`, and the waiting for them.
void drop_disabled(GraphFile& graph);

/// The nodes in an order in which each comes after those it waits for, otherwise as in the file.
void sort_by_start(GraphFile& graph);

/// Order of stopping, as groups to be stopped together one group after the other: a node goes
/// before those it came `after`. Nodes with `stop.order: last`, and all that they came after, are
/// at the end, in the same order. Precondition: no circle.
std::vector<std::vector<std::string>> stop_order(const GraphFile& graph);

}  // namespace mimesis::launch
