#pragma once
#include <map>
#include <string>
#include <vector>

#include "tools/mimesis/launch/command.h"

namespace mimesis::launch {

/// Units of systemd with which a host boots its part of a graph, without the launcher.
struct BootUnits {
  std::map<std::string, std::string> files;  ///< text by name
  std::vector<std::string> notes;            ///< what of the launch file units cannot do
};

/// Folder of a graph's logs, one for each boot, for `Run::log` of an export: the id of the boot is
/// filled in by systemd.
std::string boot_log(const std::string& graph);

/// A service for each node of `host`, and the target mimesis-GRAPH.target that starts and stops
/// them. `host`: empty for this machine. The same file gives the same bytes.
/// @param graph  sorted by start
/// @throws ConfigError for a graph that needs the launcher.
BootUnits boot_units(GraphFile graph, const Run& run, const std::string& host);

/// Writes the units into a folder and removes those of an earlier export of this graph that are no
/// longer among them; returns their names. @throws ConfigError if a file cannot be written.
std::vector<std::string> write_units(const std::string& folder, const std::string& graph,
                                     const BootUnits& units);

}  // namespace mimesis::launch
