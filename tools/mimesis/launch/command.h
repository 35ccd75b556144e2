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
      sets;                ///< --set NODE.KEY=VALUE as (node, KEY=VALUE)
  bool verbose = false;    ///< all that nodes print is shown
  double timeout_s = 0.0;  ///< of wall time, then the run is stopped; 0: never
};

/// A program to start.
struct Command {
  std::vector<std::string> argv;  ///< argv[0]: path, or name if it was not found
  std::vector<std::pair<std::string, std::string>> env;  ///< added to the launcher's own
};

/// How a host starts a node.
struct Start {
  Command command;
  Sched sched;
  // For the engine systemd:
  std::string unit, slice;  ///< names; no unit: a process of ours
  bool notifies = false;    ///< it tells systemd when it is ready
  int stop_signal = SIGINT;
  nanoseconds stop_timeout{};
  nanoseconds watchdog{};  ///< systemd ends it after this silence; 0: never
};

/// Path of a node's program: as given if it has a '/', else beside this program, else on PATH;
/// empty if there is none.
std::string find_executable(const std::string& exec);

/// How a node is started on its host.
Command command(const GraphFile& graph, const NodeSpec& node, const Run& run);
Start start_of(const GraphFile& graph, const NodeSpec& node, const Run& run);

/// Names of a graph's slice and of its nodes' units: mimesis-GRAPH.slice,
/// mimesis-GRAPH-NODE.service, where names have other characters escaped as systemd-escape(1) does.
std::string slice_name(const std::string& graph);
std::string unit_name(const std::string& graph, const std::string& node);
/// A node of Mimesis by its name, which tells systemd when it is ready and that it lives.
bool notifies(const NodeSpec& node);
/// It has to live: its silence ends the run, or has it started again.
bool must_live(const NodeSpec& node);

/// The nodes, other than `reader`, that publish `topic`.
std::vector<std::string> publishers(const GraphFile& graph, const std::string& topic,
                                    const std::string& reader);

/// tcp://ADDRESS:PORT where a node is reached from other hosts, the port of the file or *, which
/// the graph's directory tells; empty if all nodes are on one host.
std::string bind_address(const GraphFile& graph, const NodeSpec& node);

/// The same for a person or the check: on another host through ssh, with these options.
Command command_from_here(const GraphFile& graph, const NodeSpec& node, const Run& run,
                          const std::vector<std::string>& ssh_options = {});

/// ssh without questions, running `line` on a host. `more`: options of ssh
Command ssh(const Host& host, const std::string& line, const std::vector<std::string>& more = {});

/// The graph as it is started: on a simulated clock with the node `clock` in front, for which all
/// nodes that step with the graph wait.
GraphFile with_clock(GraphFile graph);

/// For people: words with quotes where a shell would need them.
std::string shell_line(const Command& command);

/// Finds the mistakes of a launch file: programs, hosts and CPUs that do not exist, and, from what
/// the nodes of this machine say of themselves (--describe), ports, topics, message types, inputs
/// left out, simulated buses with one end, fields of `result:`, parameters.
/// @param whole  every node is made without sockets and devices (--check), so that it finds all
///               that it would refuse; else it tells its ports, which takes milliseconds
void check_graph(const GraphFile& graph, const Run& run, bool whole, Mistakes& mistakes);

}  // namespace mimesis::launch
