#pragma once
#include <string>
#include <utility>
#include <vector>

#include "tools/mimesis/launch/graph_file.h"
#include "tools/mimesis/launch/section.h"

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

/// Names and values that `for` binds.
using Bound = std::vector<std::pair<std::string, std::string>>;

/// A node or group as it is written, once for each value of its `for`.
struct Written {
  Text name;  ///< variables are replaced
  const runtime::Yaml* map = nullptr;
  std::string path;              ///< within the file: "groups.eyes.nodes.eye_${arg:i}"
  Bound bound;                   ///< by its own `for` and those around it
  runtime::Variables variables;  ///< these among them
};

/// The entries of `map`, which stands at `path` of its file, in their order.
/// @param around  what stands around the map: its bound names and its variables
/// @param named  each entry has names of its own: its key must hold the bound names
std::vector<Written> expand(const runtime::Yaml& map, const std::string& path,
                            const Written& around, bool named, Mistakes& mistakes);

}  // namespace mimesis::launch
