// Launch files and groups become one graph.
#include "tools/mimesis/launch/join.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <sstream>

#include "common/error.h"
#include "common/runtime/registry.h"

namespace mimesis::launch {
namespace {

template <class Named>
auto find_named(Named& all, const std::string& name) {
  return std::ranges::find(all, name, [](const auto& one) { return one.name.text; });
}

}  // namespace

void join(GraphFile& graph, Group&& group) {
  const auto same = find_named(graph.groups, group.name.text);
  if (same == graph.groups.end()) return graph.groups.push_back(std::move(group));
  same->nodes.insert(same->nodes.end(), group.nodes.begin(), group.nodes.end());
}

void set_namespace(GraphFile& part, const std::string& name_space) {
  std::set<std::string> names;
  for (const NodeSpec& node : part.nodes) names.insert(node.name.text);
  for (const Group& group : part.groups) names.insert(group.name.text);
  const auto rename = [&](std::string& text) {
    if (names.contains(text.substr(0, text.find('/')))) text = name_space + "_" + text;
  };
  for (NodeSpec& node : part.nodes) {
    rename(node.name.text);
    for (Text& before : node.after) rename(before.text);
    for (auto* wires : {&node.in, &node.out}) {
      for (Wire& wire : *wires) rename(wire.topic.text);
    }
  }
  for (Text& topic : part.outside) rename(topic.text);
  for (Group& group : part.groups) {
    rename(group.name.text);
    for (std::string& node : group.nodes) rename(node);
  }
}

void join(GraphFile& graph, GraphFile&& part, Mistakes& mistakes) {
  for (Host& host : part.hosts) {
    const auto same = find_named(graph.hosts, host.name.text);
    if (same == graph.hosts.end()) {
      graph.hosts.push_back(std::move(host));
      continue;
    }
    const runtime::Place place = std::exchange(host.name.place, same->name.place);
    if (host != *same) {
      mistakes.add(place, fmt::format("host '{}' is another one at {}, expected the same values",
                                      host.name.text, to_string(same->name.place)));
    }
  }
  graph.incomplete = graph.incomplete || part.incomplete;
  std::ranges::move(part.nodes, std::back_inserter(graph.nodes));
  std::ranges::move(part.outside, std::back_inserter(graph.outside));
  for (Group& group : part.groups) join(graph, std::move(group));
  part.included.insert(part.included.begin(), part.file);
  for (std::string& file : part.included) {
    if (std::ranges::find(graph.included, file) == graph.included.end())
      graph.included.push_back(std::move(file));
  }
}

void open_groups(GraphFile& graph, Mistakes& mistakes) {
  for (const Group& group : graph.groups) {
    if (const NodeSpec* node = graph.find(group.name.text)) {
      mistakes.add(group.name.place,
                   fmt::format("group '{}' has the name of a node ({}), expected another one",
                               group.name.text, to_string(node->name.place)));
    }
  }
  for (NodeSpec& node : graph.nodes) {
    std::vector<Text> after;
    for (Text& before : node.after) {
      const auto group = find_named(graph.groups, before.text);
      if (group == graph.groups.end()) {
        after.push_back(std::move(before));
        continue;
      }
      for (const std::string& name : group->nodes) after.push_back({name, before.place});
    }
    node.after = std::move(after);
  }
}

bool check_name(const Text& name, const std::string& what, Mistakes& mistakes) {
  try {
    runtime::check_name(what, name.text);
    return true;
  } catch (const ConfigError& e) {
    mistakes.add(name.place, e.what());
    return false;
  }
}

bool check_names(const GraphFile& graph, Mistakes& mistakes) {
  bool good = true;
  std::map<std::string, runtime::Place> places;
  for (const NodeSpec& node : graph.nodes) {
    good = check_name(node.name, "node name", mistakes) && good;
    const auto [first, is_new] = places.emplace(node.name.text, node.name.place);
    if (is_new) continue;
    good = false;
    mistakes.add(node.name.place,
                 fmt::format("there is a node '{}' already ({}), expected another name, or a "
                             "namespace of what is included",
                             node.name.text, to_string(first->second)));
  }
  return good;
}

namespace {

using runtime::Yaml;

struct Repetition {
  std::string name;
  std::vector<Text> values;
};

/// `for: {NAME: [a, b, c]}`, or one text with commas. Empty, with a mistake noted, if it is wrong.
std::optional<Repetition> read_for(const Yaml& value, const Written& around, Mistakes& mistakes) {
  if (value.kind != Yaml::Kind::map || value.entries.size() != 1) {
    mistakes.add(value.place, fmt::format("for: expected {{NAME: [VALUE, ...]}}, found {}",
                                          value.entries.size() > 1 ? "several names (put one `for` "
                                                                     "on a group around the node)"
                                                                   : value.described()));
    return std::nullopt;
  }
  const Yaml::Entry& entry = value.entries.front();
  Repetition all{entry.key, {}};
  const runtime::Variables& variables = around.variables;
  const bool taken = std::ranges::any_of(
      around.bound, [&](const auto& bound) { return bound.first == entry.key; });
  if (taken || variables.declares(entry.key)) {
    mistakes.add(entry.place,
                 fmt::format("for: '{}' is {} already, expected another name", entry.key,
                             taken ? "the name of a `for` around this" : "an argument"));
    return std::nullopt;
  }
  Section section(value, variables, mistakes);
  if (entry.value.kind == Yaml::Kind::scalar) {
    const auto text = section.text(entry.key);
    if (!text) return std::nullopt;
    std::istringstream in(text->text);
    for (std::string item; std::getline(in, item, ',');) {
      const std::size_t begin = std::min(item.find_first_not_of(' '), item.size());
      item = item.substr(begin, item.find_last_not_of(' ') + 1 - begin);
      if (!item.empty()) all.values.push_back({item, text->place});
    }
  } else {
    all.values = section.texts(entry.key);
  }
  std::set<std::string> once;
  std::erase_if(all.values, [&](const Text& item) {
    const bool again = !once.insert(item.text).second;
    if (again)
      mistakes.add(item.place, fmt::format("for: the value '{}' appears twice", item.text));
    return again;
  });
  return all;
}

}  // namespace

std::vector<Written> expand(const Yaml& map, const std::string& path, const Written& around,
                            bool named, Mistakes& mistakes) {
  std::vector<Written> all;
  for (const Yaml::Entry& entry : map.entries) {
    Yaml key;
    key.kind = Yaml::Kind::scalar;
    key.text = entry.key;
    key.place = entry.place;
    Written one{.name = {entry.key, entry.place},
                .map = &entry.value,
                .path = path + "." + entry.key,
                .bound = around.bound,
                .variables = around.variables};
    const auto add = [&] {
      for (const auto& [name, value] : one.bound) {
        const std::string reference = "${arg:" + name + "}";
        if (!named || entry.key.find(reference) != std::string::npos) continue;
        mistakes.add(entry.place,
                     fmt::format("'{}' is repeated by `for`, expected {} in its name, did you mean "
                                 "'{}{}'?",
                                 entry.key, reference, entry.key, reference));
        return false;
      }
      if (auto name = Section(map, one.variables, mistakes).expand(key, "a name")) {
        one.name = std::move(*name);
        all.push_back(one);
      }
      return true;
    };
    const Yaml* repeated = entry.value.find("for");
    if (repeated == nullptr) {
      add();
      continue;
    }
    const auto repetition = read_for(*repeated, around, mistakes);
    if (!repetition) continue;
    for (const Text& value : repetition->values) {
      one.bound = around.bound;
      one.bound.emplace_back(repetition->name, value.text);
      one.variables.bind(repetition->name, value.text);
      if (!add()) break;
    }
  }
  return all;
}

}  // namespace mimesis::launch
