#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <iostream>
#include <nlohmann/json.hpp>

#include "common/json_text.h"
#include "tools/mimesis/graph_tools.h"
#include "tools/mimesis/table.h"
#include "tools/mimesis/verb.h"

namespace mimesis::tool {
namespace {

int list_graphs(bool json) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  TextTable table({"GRAPH", "NODES", "READY", "CLOCK"});
  for (const std::string& graph : running_graphs()) {
    const auto nodes = runtime::GraphView(graph).nodes();
    const auto ready = std::ranges::count_if(nodes, &v1::NodeInfo::ready);
    // The node clock itself, recorders and viewers are on the wall clock in every graph.
    std::string clock = "wall";
    for (const v1::NodeInfo& node : nodes) {
      if (!node.clock().empty() && node.clock() != "wall") clock = node.clock();
    }
    list.push_back({{"graph", graph},
                    {"nodes", node_names(nodes)},
                    {"ready", ready},
                    {"clock", clock},
                    {"directory", runtime::graph_directory(graph)}});
    table.row({graph, std::to_string(nodes.size()), std::to_string(ready), clock});
  }
  if (json) {
    std::cout << json_text(list) << '\n';
  } else if (list.empty()) {
    std::cerr << "no graph runs\n";
  } else {
    table.print(std::cout, use_colour(STDOUT_FILENO));
  }
  return 0;
}

}  // namespace

void add_graph(CLI::App& program, int& exit_code) {
  CLI::App* graph = program.add_subcommand("graph");
  graph->require_subcommand(1);
  CLI::App* list = graph->add_subcommand("list", "Graphs of this user that run on this host");
  auto o = std::make_shared<GraphOptions>();
  list->add_flag("--json", o->json, "Machine-readable output (tools/mimesis/README.md)");
  list->footer("Examples:\n  mimesis graph list\n  mimesis graph list --json");
  list->callback([=, &exit_code] { exit_code = list_graphs(o->json); });
}

}  // namespace mimesis::tool
