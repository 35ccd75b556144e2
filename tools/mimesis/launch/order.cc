// In which order nodes start and stop.
#include <algorithm>
#include <map>
#include <set>

#include "common/runtime/value_text.h"
#include "tools/mimesis/launch/graph_file.h"

namespace mimesis::launch {
namespace {

/// Depth-first search along `after`; a node met twice on one path closes a circle.
class CircleSearch {
 public:
  CircleSearch(const GraphFile& graph, Mistakes& mistakes) : graph_(graph), mistakes_(mistakes) {}

  void visit(const NodeSpec& node) {
    if (!done_.insert(&node).second) return;
    path_.push_back(node.name.text);
    for (const Text& before : node.after) {
      const auto on_path = std::find(path_.begin(), path_.end(), before.text);
      if (on_path != path_.end()) {
        std::string circle;
        for (auto it = on_path; it != path_.end(); ++it) circle += *it + " -> ";
        mistakes_.add(before.place, "nodes wait for each other: " + circle + before.text);
      } else if (const NodeSpec* next = graph_.find(before.text)) {
        visit(*next);
      }
    }
    path_.pop_back();
  }

 private:
  const GraphFile& graph_;
  Mistakes& mistakes_;
  std::vector<std::string> path_;
  std::set<const NodeSpec*> done_;
};

/// Length of the longest chain of `after` below a node.
int level(const GraphFile& graph, const NodeSpec& node) {
  int below = -1;
  for (const Text& before : node.after) {
    if (const NodeSpec* next = graph.find(before.text))
      below = std::max(below, level(graph, *next));
  }
  return below + 1;
}

void add_with_all_before(const GraphFile& graph, const NodeSpec& node,
                         std::set<std::string>& names) {
  if (!names.insert(node.name.text).second) return;
  for (const Text& before : node.after) {
    if (const NodeSpec* next = graph.find(before.text)) add_with_all_before(graph, *next, names);
  }
}

}  // namespace

void check_order(const GraphFile& graph, Mistakes& mistakes) {
  std::vector<std::string> known;
  for (const NodeSpec& node : graph.nodes) known.push_back(node.name.text);
  for (const Group& group : graph.groups) known.push_back(group.name.text);
  for (const NodeSpec& node : graph.nodes) {
    for (const Text& before : node.after) {
      if (graph.find(before.text) == nullptr && !graph.incomplete) {
        mistakes.add(before.place, "after: there is no node '" + before.text + "'" +
                                       runtime::did_you_mean(before.text, known));
      }
    }
  }
  CircleSearch search(graph, mistakes);
  for (const NodeSpec& node : graph.nodes) search.visit(node);
}

void drop_disabled(GraphFile& graph) {
  for (NodeSpec& node : graph.nodes) {
    const auto host = std::ranges::find_if(
        graph.hosts, [&](const Host& h) { return node.host && h.name.text == node.host->text; });
    if (host != graph.hosts.end() && !host->enabled) node.host.reset();
  }
  for (Host& host : graph.hosts) host.here = host.here && host.enabled;
  std::ranges::copy_if(graph.nodes, std::back_inserter(graph.disabled),
                       [](const NodeSpec& node) { return !node.enabled; });
  std::erase_if(graph.nodes, [](const NodeSpec& node) { return !node.enabled; });
  for (NodeSpec& node : graph.nodes) {
    std::erase_if(node.after,
                  [&](const Text& before) { return graph.find(before.text) == nullptr; });
  }
}

void sort_by_start(GraphFile& graph) {
  std::map<std::string, int> levels;
  for (const NodeSpec& node : graph.nodes) levels[node.name.text] = level(graph, node);
  std::ranges::stable_sort(graph.nodes, {},
                           [&](const NodeSpec& node) { return levels[node.name.text]; });
}

std::vector<std::vector<std::string>> stop_order(const GraphFile& graph) {
  std::set<std::string> last;
  for (const NodeSpec& node : graph.nodes) {
    if (node.stop.last) add_with_all_before(graph, node, last);
  }
  // Key: ordinary nodes before `last` ones, then from the top of the chains down.
  std::map<std::pair<bool, int>, std::vector<std::string>> groups;
  for (const NodeSpec& node : graph.nodes) {
    groups[{last.contains(node.name.text), -level(graph, node)}].push_back(node.name.text);
  }
  std::vector<std::vector<std::string>> order;
  for (auto& [key, group] : groups) order.push_back(std::move(group));
  return order;
}

}  // namespace mimesis::launch
