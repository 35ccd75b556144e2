#pragma once
#include <string>
#include <utility>
#include <vector>

#include "tools/mimesis/launch/section.h"

namespace mimesis::launch {

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
