#pragma once
#include "tools/mimesis/launch/graph_file.h"

namespace mimesis::launch {

/// The nodes and groups of an included file get the prefix NAME_SPACE_, and what of it names them:
/// `after`, and topics NODE/PORT.
void set_namespace(GraphFile& part, const std::string& name_space);

/// What an included file has becomes a part of the file around: nodes, groups, hosts, `outside`.
void join(GraphFile& graph, GraphFile&& part, Mistakes& mistakes);
/// Repetitions of a group have one name.
void join(GraphFile& graph, Group&& group);

/// Whoever waits for a group waits for all its nodes.
void open_groups(GraphFile& graph, Mistakes& mistakes);

/// False, with a mistake noted, if the name of `what` cannot be one.
bool check_name(const Text& name, const std::string& what, Mistakes& mistakes);

/// Notes names of nodes that are none, and nodes of one name. False if there are some.
bool check_names(const GraphFile& graph, Mistakes& mistakes);

}  // namespace mimesis::launch
