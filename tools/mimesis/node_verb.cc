#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "common/runtime/raw.h"
#include "tools/mimesis/graph_tools.h"
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
    std::cout << json_text(list) << '\n';
    return 0;
  }
  if (nodes.empty()) {
    std::cerr << "graph '" << graph << "' has no nodes\n";
    return 0;
  }
  TextTable table({"NODE", "PID", "STATE", "CLOCK", "IN", "OUT", "HOST"});
  for (const v1::NodeInfo& node : nodes) {
    table.row({node.name(), std::to_string(node.pid()), node.ready() ? "ready" : "starting",
               node.clock(), std::to_string(node.inputs_size()),
               std::to_string(node.outputs_size()), node.host()});
  }
  table.print(std::cout, use_colour(STDOUT_FILENO));
  return 0;
}

/// One node: who it is, its ports and services.
int node_info(const GraphOptions& options, const std::string& name) {
  std::vector<v1::NodeInfo> nodes;
  const v1::NodeInfo* node = find_node(options, name, nodes);
  if (node == nullptr) return kNotFound;
  if (options.json) {
    std::cout << json_text(node_json(*node)) << '\n';
    return 0;
  }
  std::cout << fmt::format(
      "node     {}\nprogram  {}\nprocess  {} on {}\nclock    {}\nstarted  {}\n", node->name(),
      node->executable(), node->pid(), node->host(), node->clock(), human_time(node->started_ns()));
  TextTable table({"", "PORT", "TOPIC", "TYPE", "POLICY"});
  for (const v1::TopicInfo& in : node->inputs()) {
    if (in.port().starts_with('.')) continue;  // the runtime's
    table.row({"in", in.port(), in.topic().empty() ? "(not wired)" : in.topic(), in.type(),
               in.policy() + (in.obeys().empty() ? "" : ", of " + in.obeys() + " alone")});
  }
  for (const v1::TopicInfo& out : node->outputs())
    table.row({"out", out.port(), out.topic(), out.type(), out.latched() ? "latched" : ""});
  for (const v1::ServiceInfo& s : node->services())
    table.row({"service", "", s.service(), s.request_type() + " -> " + s.response_type(), ""});
  table.print(std::cout, use_colour(STDOUT_FILENO));
  return 0;
}

}  // namespace

void add_node(CLI::App& program, int& exit_code) {
  CLI::App* node = program.add_subcommand("node");
  node->require_subcommand(1);
  CLI::App* list = node->add_subcommand("list", "Nodes that run now");
  auto o = std::make_shared<GraphOptions>();
  auto name = std::make_shared<std::string>();
  add_graph_options(*list, *o);
  list->footer("Examples:\n  mimesis node list\n  mimesis node list --json --graph demo");
  list->callback([=, &exit_code] { exit_code = list_nodes(chosen_graph(*o), o->json); });

  CLI::App* info = node->add_subcommand("info", "A node's process, ports and services");
  info->add_option("node", *name, "Name of the node")->required();
  add_graph_options(*info, *o, "the node to be ready");
  info->footer(
      "Parameters: mimesis param list NODE.\n"
      "Examples:\n  mimesis node info planner\n  mimesis node info planner --json");
  info->callback([=, &exit_code] {
    o->graph = chosen_graph(*o);
    exit_code = node_info(*o, *name);
  });
}

}  // namespace mimesis::tool
