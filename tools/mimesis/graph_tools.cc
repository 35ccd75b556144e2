#include "tools/mimesis/graph_tools.h"

#include <fmt/format.h>
#include <poll.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iostream>
#include <set>

#include "common/error.h"
#include "common/runtime/registry.h"
#include "common/runtime/services.h"
#include "common/runtime/value_text.h"
#include "proto/params.pb.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {

using Clock = std::chrono::steady_clock;

void add_graph_options(CLI::App& verb, GraphOptions& options, const std::string& wait) {
  verb.add_option("--graph", options.graph,
                  "Name of the graph (default: MIMESIS_GRAPH, or the only one that runs)");
  verb.add_flag("--json", options.json, "Machine-readable output (tools/mimesis/README.md)");
  if (wait.empty()) return;
  verb.add_option("--timeout", options.timeout_s,
                  "Longest wait for " + wait + " [s]; then exit code 3")
      ->check(number_above_zero)
      ->capture_default_str();
}

std::vector<std::string> running_graphs() {
  std::vector<std::string> graphs;
  std::error_code ignored;
  const std::filesystem::path own = runtime::graph_directory(runtime::graph_name());
  for (const auto& folder : std::filesystem::directory_iterator(own.parent_path(), ignored)) {
    const std::string name = folder.path().filename();
    if (!std::filesystem::is_directory(folder.path() / "nodes", ignored)) continue;
    if (!runtime::GraphView(name).nodes().empty()) graphs.push_back(name);
  }
  std::ranges::sort(graphs);
  return graphs;
}

std::string chosen_graph(const GraphOptions& options) {
  if (!options.graph.empty()) return options.graph;
  const std::string name = runtime::graph_name();
  if (std::getenv("MIMESIS_GRAPH") != nullptr || !runtime::GraphView(name).nodes().empty())
    return name;
  const std::vector<std::string> running = running_graphs();
  if (running.size() == 1) return running.front();
  if (running.size() > 1) {
    std::cerr << fmt::format("graph '{}' has no nodes; there are: {} (--graph NAME)\n", name,
                             fmt::join(running, ", "));
  }
  return name;
}

std::vector<std::string> node_names(const std::vector<v1::NodeInfo>& nodes) {
  std::vector<std::string> names;
  for (const v1::NodeInfo& node : nodes) names.push_back(node.name());
  return names;
}

std::vector<std::string> topic_names(const std::vector<v1::NodeInfo>& nodes) {
  std::set<std::string> names;
  for (const v1::NodeInfo& node : nodes) {
    for (const auto* topics : {&node.outputs(), &node.inputs()}) {
      for (const v1::TopicInfo& topic : *topics) names.insert(topic.topic());
    }
  }
  names.erase("");
  names.erase("*");
  return {names.begin(), names.end()};
}

std::vector<std::string> service_names(const std::vector<v1::NodeInfo>& nodes) {
  std::vector<std::string> names;
  for (const v1::NodeInfo& node : nodes) {
    for (const v1::ServiceInfo& service : node.services()) names.push_back(service.service());
  }
  return names;
}

const v1::NodeInfo* find_node(const GraphOptions& options, const std::string& name,
                              std::vector<v1::NodeInfo>& nodes) {
  runtime::GraphView view(options.graph);
  const auto deadline = Clock::now() + milliseconds(options.timeout_s);
  for (;;) {
    nodes = view.nodes();
    const auto node = std::ranges::find(nodes, name, &v1::NodeInfo::name);
    if (node != nodes.end() && node->ready()) return &*node;
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    // A graph without such a node is not waited for: the name is wrong, or the graph.
    if (node == nodes.end() || left.count() <= 0) {
      std::cerr << fmt::format("no node '{}' {}in graph '{}'{}\n", name,
                               node == nodes.end() ? "" : "that is ready ", options.graph,
                               runtime::did_you_mean(name, node_names(nodes)));
      return nullptr;
    }
    view.wait(left);
  }
}

tl::expected<std::string, Status> call_service(const std::vector<v1::NodeInfo>& nodes,
                                               const std::string& service,
                                               const std::string& request,
                                               std::chrono::milliseconds timeout) {
  const auto server = std::ranges::find_if(nodes, [&](const v1::NodeInfo& node) {
    return std::ranges::any_of(node.services(),
                               [&](const auto& s) { return s.service() == service; });
  });
  if (server == nodes.end() || server->service_endpoints().empty()) {
    return tl::unexpected(Status{"no node offers service " + service +
                                 runtime::did_you_mean(service, service_names(nodes))});
  }
  runtime::ZmqContext context;
  runtime::TcpGate gate(context);
  runtime::ServiceClient client(context, gate, server->service_endpoints(0), server->public_key());
  const std::uint64_t number = client.send(service, request);
  const auto deadline = Clock::now() + timeout;
  for (;;) {
    if (auto answer = client.receive(number)) return *std::move(answer);
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - Clock::now());
    if (left.count() <= 0) {
      return tl::unexpected(Status{fmt::format("node '{}' did not answer within {} s",
                                               server->name(), to_seconds(timeout))});
    }
    zmq_pollitem_t item{client.handle(), 0, ZMQ_POLLIN, 0};
    zmq_poll(&item, 1, left.count());
  }
}

namespace {

/// For completions: no errors, whatever the state of the graph is.
std::vector<std::string> names_for(const std::string& what, const std::string& graph,
                                   const std::vector<std::string>& before) {
  if (what == "graph") return running_graphs();
  try {
    const GraphOptions options{.graph = graph};
    const auto nodes = runtime::GraphView(chosen_graph(options)).nodes();
    if (what == "topic") return topic_names(nodes);
    if (what == "node") return node_names(nodes);
    if (what == "service") return service_names(nodes);
    if ((what != "key" && what != "values") || before.empty()) return {};
    constexpr std::chrono::milliseconds kPatience{100};
    const auto answer = call_service(nodes, before.front() + "/params", "", kPatience);
    v1::ParamSet params;
    if (!answer || !params.ParseFromString(*answer)) return {};
    std::vector<std::string> keys;
    for (const v1::Param& p : params.params()) {
      if (what == "key" || p.changeable()) keys.push_back(p.key());
    }
    return keys;
  } catch (const std::exception&) {
    return {};
  }
}

const bool names_are_known = (live_names = names_for, true);

}  // namespace

namespace {

bool moves_actuators(const v1::NodeInfo& node) {
  return std::ranges::any_of(node.services(), [&](const v1::ServiceInfo& service) {
    return service.service() == node.name() + "/enable";
  });
}

/// Why `topic` is not to be published; empty: it may be.
std::string objection(const LivePublishing& wish, const std::string& topic,
                      const std::vector<v1::NodeInfo>& nodes, const std::string& bridge) {
  std::vector<std::string> publishers, obeyed, readers;
  bool one_author = false, obeys_us = true;
  for (const v1::NodeInfo& node : nodes) {
    if (node.name() == wish.self) continue;
    for (const v1::TopicInfo& out : node.outputs()) {
      if (out.topic() == topic) publishers.push_back(node.name());
    }
    for (const v1::TopicInfo& in : node.inputs()) {
      if (in.topic() != topic) continue;
      readers.push_back(node.name());
      if (!in.one_author()) continue;
      one_author = true;
      obeys_us = obeys_us && in.obeys() == wish.self;
      if (!in.obeys().empty() && in.obeys() != wish.self) obeyed.push_back(in.obeys());
    }
  }
  std::string why;
  if (!publishers.empty()) {
    why = fmt::format("node {} publishes it", publishers.front());
  } else if (one_author && !obeys_us) {
    why = obeyed.empty() ? "it may lead to motion"
                         : fmt::format("it is taken from node {} alone", obeyed.front());
  } else if (!readers.empty() && !bridge.empty()) {
    why = fmt::format("node {} moves actuators", bridge);
  } else {
    return {};
  }
  std::ranges::sort(readers);
  readers.erase(std::unique(readers.begin(), readers.end()), readers.end());
  return fmt::format("{} ({}; {})", topic, why,
                     readers.empty() ? "nobody would hear it"
                                     : fmt::format("heard by {}", fmt::join(readers, ", ")));
}

}  // namespace

std::string launched_as() {
  const char* name = std::getenv("MIMESIS_NODE");
  return name != nullptr ? name : "";
}

void demand_leave(const LivePublishing& wish, const std::vector<v1::NodeInfo>& nodes) {
  const auto bridge = std::ranges::find_if(nodes, moves_actuators);
  std::vector<std::string> refused;
  for (const std::string& topic : wish.topics) {
    if (wish.into_live.contains(topic)) continue;
    std::string why = objection(wish, topic, nodes, bridge == nodes.end() ? "" : bridge->name());
    if (!why.empty()) refused.push_back(std::move(why));
  }
  if (refused.empty()) return;
  throw ConfigError(
      fmt::format("{}: the graph is live, and nothing is published: {}. --into-live TOPIC "
                  "publishes a topic all "
                  "the same (inputs of one author refuse it as long as that lives); "
                  "MIMESIS_GRAPH=NAME chooses a "
                  "graph of its own",
                  wish.verb, fmt::join(refused, ", ")));
}

}  // namespace mimesis::tool
