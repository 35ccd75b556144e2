#include "tools/mimesis/launch/graph_file.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <cstring>
#include <map>
#include <set>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "common/time.h"

namespace mimesis::launch {
namespace {

using runtime::Yaml;

constexpr nanoseconds kShortestLoss = std::chrono::seconds(3);  // it is noticed after 2 s

void read_restart(Section& node, Restart& restart) {
  const Yaml* value = node.take("restart");
  if (value == nullptr) return;
  if (value->kind == Yaml::Kind::scalar) {
    const auto policy = node.choice("restart", {"never", "on-failure"});
    if (policy) restart.on_failure = *policy == "on-failure";
    return;
  }
  node.section("restart", [&](Section& s) {
    restart.on_failure =
        s.choice("policy", {"never", "on-failure"}).value_or("on-failure") == "on-failure";
    restart.delay = s.duration("delay").value_or(restart.delay);
    restart.backoff = s.number("backoff", 1.0, 100.0).value_or(restart.backoff);
    restart.max = s.whole("max", 1, 1000).value_or(restart.max);
    restart.window = s.duration("window").value_or(restart.window);
  });
}

/// The keys that `defaults:` and a node share.
void read_common(Section& s, NodeSpec& t) {
  read_restart(s, t.restart);
  s.section("stop", [&](Section& stop) {
    if (const auto order = stop.choice("order", {"reverse", "last"}))
      t.stop.last = *order == "last";
    if (const auto name = stop.choice("signal", {"INT", "TERM"})) {
      t.stop.signal = *name == "INT" ? SIGINT : SIGTERM;
    }
    t.stop.timeout = stop.duration("timeout").value_or(t.stop.timeout);
  });
  s.section("sched", [&](Section& sched) {
    t.sched.place = sched.place();
    t.sched.policy = sched.choice("policy", {"other", "fifo", "rr"}).value_or(t.sched.policy);
    if (!sched.has("priority") && t.sched.policy != "other" && t.sched.priority == 0) {
      sched.mistakes().add(sched.place(),
                           "policy " + t.sched.policy + " needs a priority in [1, 99]");
    }
    t.sched.priority = sched.whole("priority", 1, 99).value_or(t.sched.priority);
    if (const auto cpus = sched.wholes("cpus", 0, 1023); !cpus.empty()) t.sched.cpus = cpus;
    t.sched.mlock = sched.flag("mlock").value_or(t.sched.mlock);
  });
  if (const Yaml* ready = s.take("ready"); ready != nullptr && ready->kind == Yaml::Kind::scalar) {
    t.ready_when_started = s.choice("ready", {"started"}).has_value();
  } else {
    s.section("ready", [&](Section& within) {
      t.ready_within = within.duration("within").value_or(t.ready_within);
    });
  }
  t.hung_after = s.duration("hung_after").value_or(t.hung_after);
  if (auto host = s.text("host")) t.host = std::move(*host);
  s.entries("env", [&](const Text& name, const Yaml& value) {
    if (auto text = s.expand(value, "text")) t.env.emplace_back(name.text, text->text);
  });
}

std::vector<Wire> read_wires(Section& node, const std::string& key) {
  std::vector<Wire> wires;
  node.entries(key, [&](const Text& port, const Yaml& topic) {
    if (key == "in" && topic.kind == Yaml::Kind::empty) {
      wires.push_back({port.text, {"", topic.place}, port.place});
    } else if (auto text = node.expand(topic, "a topic")) {
      wires.push_back({port.text, std::move(*text), port.place});
    }
  });
  return wires;
}

/// `node`: the settings of one that does not say otherwise.
NodeSpec read_node(const Text& name, Section& s, NodeSpec node) {
  node.name = name;
  if (auto exec = s.text("exec")) {
    node.exec = std::move(*exec);
  } else if (!s.has("exec")) {
    s.mistakes().add(name.place, fmt::format("node '{}' has no exec", name.text));
  }
  node.args = s.texts("args");
  node.in = read_wires(s, "in");
  node.out = read_wires(s, "out");
  node.after = s.texts("after");
  node.required = s.flag("required").value_or(false);
  node.enabled = s.flag("if").value_or(true);
  if (const Yaml* params = s.take("params");
      params != nullptr && params->kind != Yaml::Kind::map && params->kind != Yaml::Kind::empty) {
    s.mistakes().add(params->place, "expected params as a map, found " + params->described());
  }
  read_common(s, node);
  if (node.sched.mlock && !node.takes_node_options()) {
    if (s.has("sched"))
      s.mistakes().add(node.sched.place, "mlock: only a node of Mimesis can lock its memory");
    node.sched.mlock = false;  // of `defaults:`, which are for nodes
  }
  s.finish();
  return node;
}

bool fits(const std::string& value, const std::string& type) {
  if (type == "bool") return runtime::to_bool(value).has_value();
  if (type == "int") return runtime::to_int(value).has_value();
  if (type == "number") return runtime::to_double(value).has_value();
  if (type == "duration") return runtime::to_duration(value).has_value();
  return true;
}

void read_args(Section& top, GraphFile& graph) {
  top.entries("args", [&](const Text& name, const Yaml& declaration) {
    Section s(declaration, top.variables(), top.mistakes());
    const std::string type =
        s.choice("type", {"string", "bool", "int", "number", "duration", "path"})
            .value_or("string");
    s.text("help");
    s.take("default");
    s.finish();
    Yaml reference;
    reference.kind = Yaml::Kind::scalar;
    reference.text = "${arg:" + name.text + "}";
    reference.place = declaration.place;
    const auto value = s.expand(reference, "text");
    if (!value) return;
    if (!fits(value->text, type)) {
      const bool given = top.variables().args().contains(name.text);
      const Yaml* fallback = declaration.find("default");
      top.mistakes().add(given || fallback == nullptr ? runtime::Place{"--arg"} : fallback->place,
                         fmt::format("{}: expected {}, found '{}'", name.text, type, value->text));
    }
    graph.args.emplace_back(name.text, value->text);
  });
}

/// Its name, localhost or one of its own addresses.
bool is_this_machine(const std::string& address) {
  std::array<char, HOST_NAME_MAX + 1> own{};
  gethostname(own.data(), own.size() - 1);
  if (address == "localhost" || address == own.data()) return true;
  ifaddrs* all = nullptr;
  if (getifaddrs(&all) != 0) return false;
  bool found = false;
  for (const ifaddrs* one = all; one != nullptr; one = one->ifa_next) {
    if (one->ifa_addr == nullptr || one->ifa_addr->sa_family != AF_INET) continue;
    std::array<char, INET_ADDRSTRLEN> text{};
    sockaddr_in ip{};
    std::memcpy(&ip, one->ifa_addr, sizeof ip);
    inet_ntop(AF_INET, &ip.sin_addr, text.data(), text.size());
    found = found || address == text.data();
  }
  freeifaddrs(all);
  return found;
}

void read_hosts(Section& top, GraphFile& graph) {
  top.entries("hosts", [&](const Text& name, const Yaml& map) {
    Section s(map, top.variables(), top.mistakes());
    Host host;
    host.name = name;
    if (const auto address = s.text("address")) {
      host.address = address->text;
      host.here = is_this_machine(host.address);
    } else if (!s.has("address")) {
      top.mistakes().add(name.place, fmt::format("host '{}' has no address", name.text));
    }
    for (auto& [key, value] : {std::pair("user", &host.user), std::pair("ssh", &host.ssh),
                               std::pair("prefix", &host.prefix)}) {
      if (const auto text = s.text(key)) *value = text->text;
    }
    host.engine = s.choice("engine", {"process", "systemd"}).value_or(host.engine);
    host.first_port = s.whole("first_port", 1, 65000).value_or(0);
    host.lost_after = s.duration("lost_after").value_or(host.lost_after);
    if (host.lost_after < kShortestLoss) {
      s.mistakes().add(name.place, fmt::format("host '{}': lost_after: expected at least {:g} s",
                                               name.text, to_seconds(kShortestLoss)));
    }
    s.finish();
    graph.hosts.push_back(std::move(host));
  });
}

void read_nodes(Section& top, GraphFile& graph, const NodeSpec& defaults) {
  const Yaml* nodes = top.take("nodes");
  if (nodes == nullptr || nodes->entries.empty()) {
    top.mistakes().add(nodes != nullptr ? nodes->place : top.place(), "there are no nodes");
  }
  top.entries("nodes", [&](const Text& name, const Yaml& map) {
    Section s(map, top.variables(), top.mistakes());
    graph.nodes.push_back(read_node(name, s, defaults));
  });
}

std::optional<FieldPath> field_path(const Text& text, Mistakes& mistakes) {
  const std::size_t dot = text.text.find('.');
  if (dot == std::string::npos || dot == 0 || dot + 1 == text.text.size()) {
    mistakes.add(text.place, fmt::format("expected TOPIC.FIELD, found '{}'", text.text));
    return std::nullopt;
  }
  return FieldPath{text.text.substr(0, dot), text.text.substr(dot + 1), text.place};
}

std::optional<ResultField> result_field(const Text& name, const Yaml& value, Section& section) {
  ResultField field;
  field.name = name.text;
  std::optional<Text> from;
  if (value.kind == Yaml::Kind::map) {
    Section s(value, section.variables(), section.mistakes());
    from = s.text("from");
    if (!s.has("from"))
      section.mistakes().add(value.place, "a result field needs from: TOPIC.FIELD");
    field.scale = s.number("scale", -1e12, 1e12);
    field.digits = s.whole("digits", 0, 15);
    s.finish();
  } else {
    from = section.expand(value, "TOPIC.FIELD");
  }
  if (!from) return std::nullopt;
  const auto path = field_path(*from, section.mistakes());
  if (!path) return std::nullopt;
  field.from = *path;
  return field;
}

/// Depth-first search along `after`; a node met twice on one path closes a circle.
class CircleSearch {
 public:
  CircleSearch(const GraphFile& graph, Mistakes& mistakes) : graph_(graph), mistakes_(mistakes) {}

  void visit(const NodeSpec& node) {
    if (done_[node.name.text]) return;
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
    done_[node.name.text] = true;
  }

 private:
  const GraphFile& graph_;
  Mistakes& mistakes_;
  std::vector<std::string> path_;
  std::map<std::string, bool> done_;
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

std::string Host::target() const {
  return !ssh.empty() ? ssh : user.empty() ? address : user + "@" + address;
}

const Host* GraphFile::host_of(const NodeSpec& node) const {
  const auto host = std::ranges::find_if(
      hosts, [&](const Host& h) { return node.host ? h.name.text == node.host->text : h.here; });
  return host != hosts.end() ? &*host : nullptr;
}

const Host* GraphFile::far(const NodeSpec& node) const {
  const Host* host = host_of(node);
  return host == nullptr || host->here ? nullptr : host;
}

bool GraphFile::several_hosts() const {
  return std::ranges::any_of(nodes, [&](const NodeSpec& node) { return far(node) != nullptr; });
}

const NodeSpec* GraphFile::find(const std::string& node) const {
  const auto it =
      std::ranges::find(nodes, node, [](const NodeSpec& spec) { return spec.name.text; });
  return it != nodes.end() ? &*it : nullptr;
}

GraphFile read_graph_file(const std::string& file, const std::vector<std::string>& args,
                          const std::string& run_log, Mistakes& mistakes) {
  const Yaml document = runtime::read_yaml(file);
  runtime::Variables variables(document);
  for (const std::string& arg : args) {
    try {
      variables.set_arg(arg);
    } catch (const ConfigError& e) {
      mistakes.add_line({}, e.what());
    }
  }
  variables.set_run("log", run_log);

  GraphFile graph;
  graph.file = file;
  Section top(document, variables, mistakes);
  // Version first: a newer file may have keys that mean nothing here.
  if (const auto version = top.text("version"); !version || version->text != "1") {
    mistakes.add(version ? version->place : document.place, "expected version: 1");
    return graph;
  }
  graph.clock = top.choice("clock", {"wall", "sim", "lockstep"}).value_or("wall");
  read_args(top, graph);
  read_hosts(top, graph);
  NodeSpec defaults;
  top.section("defaults", [&](Section& s) { read_common(s, defaults); });
  read_nodes(top, graph, defaults);
  graph.outside = top.texts("outside");
  if (const Yaml* result = top.take("result");
      result != nullptr && result->kind == Yaml::Kind::map) {
    Section s(*result, variables, mistakes);
    graph.result = read_result(s);
  }
  top.finish();
  check_order(graph, mistakes);
  drop_disabled(graph);
  return graph;
}

ResultSpec read_result(Section& section) {
  ResultSpec result;
  if (auto until = section.text("until")) {
    result.until = std::move(*until);
  } else if (!section.has("until")) {
    section.mistakes().add(section.place(), "result needs until: TOPIC");
  }
  result.timeout = section.duration("timeout").value_or(result.timeout);
  result.wall_timeout = section.duration("wall_timeout").value_or(result.wall_timeout);
  if (const auto success = section.text("success")) {
    result.success = field_path(*success, section.mistakes());
  }
  section.entries("fields", [&](const Text& name, const Yaml& value) {
    if (auto field = result_field(name, value, section)) result.fields.push_back(std::move(*field));
  });
  section.finish();
  return result;
}

void check_order(const GraphFile& graph, Mistakes& mistakes) {
  std::vector<std::string> known;
  for (const NodeSpec& node : graph.nodes) known.push_back(node.name.text);
  for (const NodeSpec& node : graph.nodes) {
    for (const Text& before : node.after) {
      if (graph.find(before.text) == nullptr) {
        mistakes.add(before.place, "after: there is no node '" + before.text + "'" +
                                       runtime::did_you_mean(before.text, known));
      }
    }
  }
  CircleSearch search(graph, mistakes);
  for (const NodeSpec& node : graph.nodes) search.visit(node);
}

void drop_disabled(GraphFile& graph) {
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
