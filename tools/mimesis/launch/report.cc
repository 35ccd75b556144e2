#include "tools/mimesis/launch/report.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "tools/mimesis/launch/order.h"

namespace mimesis::launch {
namespace {

using Json = nlohmann::ordered_json;

void print(const Json& json) { std::printf("%s\n", json.dump().c_str()); }

std::string after_text(const NodeSpec& node) {
  std::string names;
  for (const Text& before : node.after) names += (names.empty() ? "" : ", ") + before.text;
  return names.empty() ? "" : "  after " + names;
}

}  // namespace

void report_mistakes(const std::string& file, const Mistakes& mistakes, bool json) {
  const std::vector<std::string> lines = mistakes.lines();
  if (json) {
    print({{"file", file}, {"ok", lines.empty()}, {"mistakes", lines}});
    return;
  }
  for (const std::string& line : lines) std::fprintf(stderr, "%s\n", line.c_str());
  if (lines.empty()) std::fprintf(stderr, "%s: no mistakes\n", file.c_str());
}

void print_plan(const GraphFile& graph, const Run& run, bool json) {
  const auto stop = stop_order(graph);
  if (!json) {
    for (const NodeSpec& node : graph.nodes) {
      std::printf("# %s%s\n%s\n", node.name.text.c_str(), after_text(node).c_str(),
                  shell_line(command(graph, node, run)).c_str());
    }
    std::printf("# stop:");
    for (const auto& group : stop)
      std::printf(" [%s]", fmt::format("{}", fmt::join(group, " ")).c_str());
    std::printf("\n");
    return;
  }
  Json start = Json::array();
  for (const NodeSpec& node : graph.nodes) {
    const Command c = command(graph, node, run);
    Json after = Json::array(), env = Json::object();
    for (const Text& before : node.after) after.push_back(before.text);
    for (const auto& [name, value] : c.env) env[name] = value;
    start.push_back({{"name", node.name.text}, {"after", after}, {"argv", c.argv}, {"env", env}});
  }
  print({{"graph", run.graph},
         {"clock", graph.clock},
         {"log", run.log},
         {"start", start},
         {"stop", stop}});
}

std::string summary_json(const Outcome& outcome, const Run& run) {
  Json nodes = Json::array();
  for (const NodeOutcome& node : outcome.nodes) {
    nodes.push_back({{"name", node.name},
                     {"exit_code", node.exit_code},
                     {"restarts", node.restarts},
                     {"killed", node.killed}});
  }
  return Json{{"exit_code", outcome.exit_code},
              {"reason", outcome.reason},
              {"graph", run.graph},
              {"log", run.log},
              {"nodes", nodes}}
      .dump();
}

}  // namespace mimesis::launch
