#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/runtime/raw.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

nlohmann::ordered_json node_json(const v1::NodeInfo& node) {
  nlohmann::ordered_json outputs = nlohmann::ordered_json::array(), inputs = outputs,
                         services = outputs;
  for (const v1::TopicInfo& out : node.outputs()) {
    outputs.push_back({{"port", out.port()}, {"topic", out.topic()}, {"type", out.type()}});
  }
  for (const v1::TopicInfo& in : node.inputs()) {
    inputs.push_back(
        {{"port", in.port()}, {"topic", in.topic()}, {"type", in.type()}, {"policy", in.policy()}});
  }
  for (const v1::ServiceInfo& service : node.services()) services.push_back(service.service());
  return {{"name", node.name()},
          {"pid", node.pid()},
          {"host", node.host()},
          {"ready", node.ready()},
          {"clock", node.clock()},
          {"executable", node.executable()},
          {"started_ns", node.started_ns()},
          {"outputs", outputs},
          {"inputs", inputs},
          {"services", services}};
}

int list_nodes(const std::string& graph, bool json) {
  const auto nodes = runtime::GraphView(graph).nodes();
  if (json) {
    nlohmann::ordered_json list = nlohmann::ordered_json::array();
    for (const v1::NodeInfo& node : nodes) list.push_back(node_json(node));
    std::cout << list.dump() << '\n';
    return 0;
  }
  if (nodes.empty()) {
    std::cerr << "graph '" << graph << "' has no nodes\n";
    return 0;
  }
  Table table({"NODE", "PID", "STATE", "CLOCK", "IN", "OUT", "HOST"});
  for (const v1::NodeInfo& node : nodes) {
    table.row({node.name(), std::to_string(node.pid()), node.ready() ? "ready" : "starting",
               node.clock(), std::to_string(node.inputs_size()),
               std::to_string(node.outputs_size()), node.host()});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  return 0;
}

}  // namespace

void add_node(CLI::App& program, int& exit_code) {
  CLI::App* node = program.add_subcommand("node");
  node->require_subcommand(1);
  CLI::App* list = node->add_subcommand("list", "Nodes that run now");
  auto graph = std::make_shared<std::string>();
  auto json = std::make_shared<bool>(false);
  list->add_option("--graph", *graph, "Name of the graph (default: MIMESIS_GRAPH, or default)");
  list->add_flag("--json", *json, "Machine-readable output (tools/mimesis/README.md)");
  list->footer("Examples:\n  mimesis node list\n  mimesis node list --json --graph demo");
  list->callback([=, &exit_code] {
    exit_code = list_nodes(graph->empty() ? runtime::graph_name() : *graph, *json);
  });
}

}  // namespace mimesis::tool
