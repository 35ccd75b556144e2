#pragma once
#include <string>
#include <utility>
#include <vector>

#include "tools/mimesis/launch/graph_file.h"

namespace mimesis::launch {

/// Settings that all nodes of a run share.
struct Run {
  std::string graph;  ///< name of the graph
  std::string log;    ///< folder for the run's logs
  std::vector<std::pair<std::string, std::string>>
      sets;              ///< --set NODE.KEY=VALUE as (node, KEY=VALUE)
  bool verbose = false;  ///< all that nodes print is shown
};

/// A program to start.
struct Command {
  std::vector<std::string> argv;  ///< argv[0]: path, or name if it was not found
  std::vector<std::pair<std::string, std::string>> env;  ///< added to the launcher's own
};

/// Path of a node's program: as given if it has a '/', else beside this program, else on PATH;
/// empty if there is none.
std::string find_executable(const std::string& exec);

/// Whether a node runs on another host.
bool remote(const GraphFile& graph, const NodeSpec& node);

/// How a node is started on this machine.
Command local_command(const GraphFile& graph, const NodeSpec& node, const Run& run);

/// How a node is started: on this machine, or through ssh on the host it names. The remote end runs
/// in a terminal session of its own (-tt), so that it is hung up when the connection ends.
Command command(const GraphFile& graph, const NodeSpec& node, const Run& run);

/// The graph as it is started: on a simulated clock with the node `clock` in front, for which all
/// nodes that step with the graph wait.
GraphFile with_clock(GraphFile graph);

/// For people: words with quotes where a shell would need them.
std::string shell_line(const Command& command);

}  // namespace mimesis::launch
