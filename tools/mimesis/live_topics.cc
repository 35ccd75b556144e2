#include "tools/mimesis/live_topics.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "common/error.h"

namespace mimesis::tool {
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
