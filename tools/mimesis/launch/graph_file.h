#pragma once
#include <chrono>
#include <csignal>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tools/mimesis/launch/section.h"

namespace mimesis::launch {

using std::chrono::nanoseconds;

/// How a node is restarted when it ends by itself with a failure.
struct Restart {
  bool on_failure = false;
  nanoseconds delay = std::chrono::milliseconds(500);  ///< before the first restart
  double backoff = 2.0;  ///< factor of the delay per restart in the window [1]
  int max = 5;           ///< restarts within the window, then it has failed
  nanoseconds window = std::chrono::seconds(60);
};

struct Stop {
  bool last = false;    ///< `order: last`: after all others, for actuators
  int signal = SIGINT;  ///< SIGINT or SIGTERM
  nanoseconds timeout = std::chrono::seconds(3);  ///< SIGKILL follows after this time
};

/// Scheduling of the process, inherited by its threads.
struct Sched {
  std::string policy = "other";  ///< other, fifo or rr
  int priority = 0;              ///< 1..99 for fifo and rr
  std::vector<int> cpus;         ///< empty: any
  bool mlock = false;            ///< its memory is locked in RAM
  runtime::Place place;
};

/// A port of a node and the topic it is wired to; an input with none is left out on purpose.
struct Wire {
  std::string port;
  Text topic;
  runtime::Place place;  ///< of the port
};

struct NodeSpec {
  Text name;
  std::string params;  ///< place of its parameters: "FILE#nodes.KEY.params"; empty: in no file
  std::vector<std::pair<std::string, std::string>> given;  ///< arguments for these
  Text exec;
  std::vector<Text> args;
  std::vector<Wire> in, out;
  std::vector<Text> after;
  std::vector<std::pair<std::string, std::string>> env;
  std::optional<Text> host;
  bool required = false;
  bool enabled = true;  ///< `if`
  Restart restart;
  Stop stop;
  nanoseconds ready_within = std::chrono::seconds(10);
  nanoseconds hung_after = std::chrono::seconds(2);  ///< without a sign of life; 0: never
  bool ready_when_started = false;  ///< `ready: started`: a foreign program, no node
  Sched sched;

  /// False for programs without the options of nodes and no part in the graph's clock: foreign
  /// ones, and `exec: mimesis` (the recorder).
  bool takes_node_options() const { return !ready_when_started && exec.text != "mimesis"; }
  /// It writes the log: its bad end makes the run a failure, though the others go on without it.
  bool records() const {
    return exec.text == "mimesis" && args.size() > 1 && args[0].text == "log" &&
           args[1].text == "record";
  }
};

/// A machine: this one, or one that is reached by ssh.
struct Host {
  Text name;
  std::string address;    ///< by which the others reach its nodes, and ssh it
  std::string user, ssh;  ///< ssh: other target than USER@ADDRESS
  std::string prefix = "/usr";
  std::string engine = "process";  ///< process or systemd: what starts its nodes
  int first_port = 0;              ///< of its nodes, three each in the order of the file; 0: any
  nanoseconds lost_after = std::chrono::seconds(30);  ///< then its nodes count as dead

  bool enabled = true;         ///< `if`; else its nodes run on the machine that launches
  bool here = false;           ///< it is this machine
  std::string target() const;  ///< for ssh
  bool operator==(const Host&) const = default;
};

/// Nodes that share settings and a condition, and for all of which others may wait.
struct Group {
  Text name;
  std::vector<std::string> nodes;
};

/// TOPIC.FIELD of a message: the topic ends at the first dot.
struct FieldPath {
  std::string topic;
  std::string field;  ///< "object_position_in_world_m.x_m"
  runtime::Place place;
};

struct ResultField {
  std::string name;
  FieldPath from;
  std::optional<double> scale;  ///< factor
  std::optional<int> digits;    ///< after the point
  std::optional<double> none;   ///< value of the message that means none: null
};

struct ResultSpec {
  Text until;                                           ///< topic whose first message ends the run
  nanoseconds timeout = std::chrono::seconds(60);       ///< longest graph time
  nanoseconds wall_timeout = std::chrono::minutes(10);  ///< guard, of wall time
  std::optional<FieldPath> success;                     ///< a bool
  std::vector<ResultField> fields;
};

/// A launch file with those that it includes, checked and with its variables replaced.
struct GraphFile {
  std::string file;
  std::vector<std::string> included;  ///< other files, each once
  bool incomplete = false;            ///< nodes are missing or double, by mistakes that are noted
  std::string clock = "wall";         ///< wall, sim or lockstep
  std::vector<std::pair<std::string, std::string>> args;  ///< effective values of all arguments
  std::vector<Host> hosts;
  std::vector<NodeSpec> nodes;  ///< enabled ones, in the order of the file
  std::vector<NodeSpec> disabled;
  std::vector<Group> groups;
  std::vector<Text> outside;  ///< topics that programs outside of the file publish
  std::optional<ResultSpec> result;

  /// An enabled one goes before others of its name.
  const NodeSpec* find(const std::string& node) const;
  /// The host of a node, if that is another one than this machine; else null.
  const Host* far(const NodeSpec& node) const;
  bool several_hosts() const;  ///< a node is on another host
  /// The host of a node, this machine too; null if the file does not declare it.
  const Host* host_of(const NodeSpec& node) const;
};

/// Reads `file`. Mistakes are collected; the result is usable if there are none.
/// @param args "NAME=VALUE" from the command line
/// @param run_log folder that `${run:log}` stands for
/// @throws ConfigError if the file cannot be read as YAML.
GraphFile read_graph_file(const std::string& file, const std::vector<std::string>& args,
                          const std::string& run_log, Mistakes& mistakes);

/// Reads the section `result:` of a launch file.
ResultSpec read_result(Section& section);

/// Notes every `after` that names no node of the file, and every circle of them.
void check_order(const GraphFile& graph, Mistakes& mistakes);

/// Removes nodes with a false `if`, and the waiting for them. Nodes of a host with one run here.
void drop_disabled(GraphFile& graph);

/// The nodes in an order in which each comes after those it waits for, otherwise as in the file.
void sort_by_start(GraphFile& graph);

/// Order of stopping, as groups to be stopped together one group after the other: a node goes
/// before those it came `after`. Nodes with `stop.order: last`, and all that they came after, are
/// at the end, in the same order. Precondition: no circle.
std::vector<std::vector<std::string>> stop_order(const GraphFile& graph);

/// JSON Schema of launch files, for editors: launch.schema.json, in the program mimesis-launch.
extern const char* const kSchema;

}  // namespace mimesis::launch
