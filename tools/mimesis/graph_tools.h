#pragma once
#include <chrono>
#include <set>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "common/runtime/raw.h"
#include "proto/runtime.pb.h"

namespace CLI {
class App;
}  // namespace CLI

// Shared by the verbs that look at a running graph.
namespace mimesis::tool {

constexpr int kNotFound = 3;  ///< exit code: not there, or timed out

/// Thrown to end a verb: a line for standard error, or none, and the exit code.
struct VerbFailure {
  std::string line;
  int exit_code;
};

/// Options that all of these verbs have.
struct GraphOptions {
  std::string graph;
  bool json = false;
  double timeout_s = 2.0;
};
/// --graph and --json; with `wait`, what it is for, --timeout as well.
void add_graph_options(CLI::App& verb, GraphOptions& options, const std::string& wait = {});
/// The graph that is meant: --graph, MIMESIS_GRAPH, or the only one that runs; for standard error
/// if that is neither of the first.
std::string chosen_graph(const GraphOptions& options);

/// Graphs of this user that have nodes, by name.
std::vector<std::string> running_graphs();

/// Name of nodes, topics or services; for suggestions and completion.
std::vector<std::string> node_names(const std::vector<v1::NodeInfo>& nodes);
std::vector<std::string> topic_names(const std::vector<v1::NodeInfo>& nodes);
std::vector<std::string> service_names(const std::vector<v1::NodeInfo>& nodes);

/// Waits until the node is ready. Null, told on standard error, if it is not after the time-out.
const v1::NodeInfo* find_node(const GraphOptions& options, const std::string& name,
                              std::vector<v1::NodeInfo>& nodes);

/// Calls NODE/NAME of `nodes`: the serialised response, or why there is none.
tl::expected<std::string, Status> call_service(const std::vector<v1::NodeInfo>& nodes,
                                               const std::string& service,
                                               const std::string& request,
                                               std::chrono::milliseconds timeout);

inline std::chrono::milliseconds milliseconds(double seconds) {
  return std::chrono::milliseconds(static_cast<std::int64_t>(1e3 * seconds));
}

// Publishing into a graph whose nodes run, without being one of them.

/// The name that the launch file of a running graph gave this process; empty: no launcher started
/// it.
std::string launched_as();

struct LivePublishing {
  std::string verb;                              ///< for messages: "mimesis log play"
  std::string self;                              ///< own name in the graph
  std::set<std::string> topics;                  ///< to be published
  std::set<std::string, std::less<>> into_live;  ///< of them, those that are meant to be heard
};

/// Refuses to publish what could move a robot, unless it is named: a topic that a node publishes
/// itself, or that an input of one author reads; and any topic that somebody reads, if there is a
/// bridge, because a way from it to the motors may exist.
/// @throws ConfigError with the topics, who would hear them, and what to do
void demand_leave(const LivePublishing& wish, const std::vector<v1::NodeInfo>& nodes);

}  // namespace mimesis::tool
