#include "tools/mimesis/launch/check.h"

#include <fmt/format.h>

#include <sstream>

#include "common/runtime/suggest.h"
#include "tools/mimesis/launch/capture.h"

namespace mimesis::launch {
namespace {

/// Topics of the file: those named in `out`, and NODE/... for outputs with their default names.
class Published {
 public:
  explicit Published(const GraphFile& graph) : graph_(graph) {
    for (const NodeSpec& node : graph.nodes) {
      for (const Wire& wire : node.out) known_.push_back(wire.topic.text);
    }
  }

  void demand(const Text& topic, Mistakes& mistakes) const {
    if (topic.text.empty()) return;  // reported as missing
    for (const std::string& known : known_) {
      if (known == topic.text) return;
    }
    const std::size_t slash = topic.text.find('/');
    const std::string publisher = topic.text.substr(0, slash);
    if (slash != std::string::npos && graph_.find(publisher) != nullptr) return;
    if (publisher == "clock" && graph_.clock != "wall") return;
    mistakes.add(topic.place,
                 fmt::format("no node publishes '{}'{}", topic.text, suggestion(topic.text)));
  }

 private:
  std::string suggestion(const std::string& topic) const {
    std::vector<std::string> candidates = known_;
    const std::size_t slash = std::min(topic.find('/'), topic.size());
    for (const NodeSpec& node : graph_.nodes)
      candidates.push_back(node.name.text + topic.substr(slash));
    return runtime::did_you_mean(topic, candidates);
  }

  const GraphFile& graph_;
  std::vector<std::string> known_;
};

bool remote(const GraphFile& graph, const NodeSpec& node) {
  for (const Host& host : graph.hosts) {
    if (node.host && host.name.text == node.host->text) return host.address != "localhost";
  }
  return false;
}

void check_host(const GraphFile& graph, const NodeSpec& node, Mistakes& mistakes) {
  if (!node.host) return;
  std::vector<std::string> known;
  for (const Host& host : graph.hosts) known.push_back(host.name.text);
  for (const std::string& name : known) {
    if (name == node.host->text) return;
  }
  mistakes.add(node.host->place, fmt::format("there is no host '{}'{}", node.host->text,
                                             runtime::did_you_mean(node.host->text, known)));
}

void check_sets(const GraphFile& graph, const Run& run, Mistakes& mistakes) {
  std::vector<std::string> known = {"clock"};
  for (const NodeSpec& node : graph.nodes) known.push_back(node.name.text);
  for (const auto& [target, set] : run.sets) {
    if (std::find(known.begin(), known.end(), target) != known.end()) continue;
    mistakes.add({"--set"}, fmt::format("{}.{}: there is no node '{}'{}", target, set, target,
                                        runtime::did_you_mean(target, known)));
  }
}

}  // namespace

void check_graph(const GraphFile& graph, const Run& run, Mistakes& mistakes) {
  const Published published(graph);
  if (graph.clock != "wall" && find_executable("mimesis_clock").empty()) {
    mistakes.add({graph.file},
                 "clock " + graph.clock + " needs the program mimesis_clock beside mimesis");
  }
  for (const NodeSpec& node : graph.nodes) {
    if (!node.exec.text.empty() && !remote(graph, node) &&
        find_executable(node.exec.text).empty()) {
      mistakes.add(node.exec.place,
                   fmt::format("node '{}': there is no program '{}' beside mimesis or on PATH",
                               node.name.text, node.exec.text));
    }
    if (node.name.text == "clock" && node.name.place.line > 0 && graph.clock != "wall") {
      mistakes.add(node.name.place,
                   "the name 'clock' belongs to the node that the launcher starts");
    }
    check_host(graph, node, mistakes);
    for (const Wire& wire : node.in) published.demand(wire.topic, mistakes);
  }
  if (graph.result) {
    published.demand(graph.result->until, mistakes);
    std::vector<FieldPath> paths;
    if (graph.result->success) paths.push_back(*graph.result->success);
    for (const ResultField& field : graph.result->fields) paths.push_back(field.from);
    for (const FieldPath& path : paths) published.demand({path.topic, path.place}, mistakes);
  }
  check_sets(graph, run, mistakes);
}

void check_parameters(const GraphFile& graph, const Run& run, Mistakes& mistakes) {
  for (const NodeSpec& node : graph.nodes) {
    if (!node.takes_node_options() || remote(graph, node)) continue;
    Command c = local_command(graph, node, run);
    if (find_executable(c.argv[0]).empty()) continue;
    c.argv.push_back("--check");
    const Captured captured = capture(c, std::chrono::seconds(10));
    if (captured.exit_code == 0) continue;
    std::istringstream lines(captured.err);
    bool any = false;
    for (std::string line; std::getline(lines, line);) {
      any = any || !line.empty();
      if (!line.empty()) mistakes.add_line(node.name.place, line);
    }
    if (!any) {
      mistakes.add(node.name.place, fmt::format("node '{}': its check ended with exit code {}",
                                                node.name.text, captured.exit_code));
    }
  }
}

}  // namespace mimesis::launch
