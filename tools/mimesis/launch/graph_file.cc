#include "tools/mimesis/launch/graph_file.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <netdb.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <climits>
#include <filesystem>
#include <iterator>
#include <map>

#include "common/error.h"
#include "common/runtime/value_text.h"
#include "common/time.h"
#include "tools/mimesis/launch/join.h"

namespace mimesis::launch {
namespace {

namespace fs = std::filesystem;
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
  if (auto host = s.text("host"))
    t.host = host->text.empty() ? std::nullopt : std::optional(std::move(*host));
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

/// `node`: the settings of one that does not say otherwise, from `defaults:` and its group.
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
  for (Text& before : s.texts("after")) node.after.push_back(std::move(before));
  node.required = s.flag("required").value_or(false);
  node.enabled = s.flag("if").value_or(true) && node.enabled;
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

/// An argument's value from outside of its file.
struct Given {
  std::string name, value;
  runtime::Place place;
};

void read_implied(Section& s, const Yaml& declared) {
  s.entries("implies", [&](const Text& name, const Yaml& value) {
    if (declared.find(name.text) == nullptr) {
      s.mistakes().add(name.place, fmt::format("implies: no argument '{}' is declared{}", name.text,
                                               runtime::did_you_mean(name.text, declared.keys())));
    }
    s.expand(value, "text");
  });
}

/// After a mistake an argument has its default: one mistake is one line.
void read_args(Section& top, runtime::Variables& variables, GraphFile& graph,
               const std::vector<Given>& given) {
  const Yaml* declared = top.take("args");
  top.entries("args", [&](const Text& name, const Yaml& declaration) {
    Section s(declaration, top.variables(), top.mistakes());
    const std::string type =
        s.choice("type", {"string", "bool", "int", "number", "duration", "path"})
            .value_or("string");
    s.text("help");
    s.take("default");
    if (type != "bool" && s.has("implies"))
      s.mistakes().add(name.place, name.text + ": implies needs type: bool");
    read_implied(s, *declared);
    s.finish();
    Yaml reference;
    reference.kind = Yaml::Kind::scalar;
    reference.text = "${arg:" + name.text + "}";
    reference.place = declaration.place;
    auto value = s.expand(reference, "text");
    if (!value) return;
    if (!fits(value->text, type)) {
      const auto from = std::ranges::find(given, name.text, &Given::name);
      const Yaml* fallback = variables.default_of(name.text);
      top.mistakes().add(from != given.end()   ? from->place
                         : fallback != nullptr ? fallback->place
                                               : runtime::Place{"--arg"},
                         fmt::format("{}: expected {}, found '{}'", name.text, type, value->text));
      if (from != given.end() && fallback != nullptr) value = s.expand(*fallback, "text");
      if (!value) return;
      variables.bind(name.text, value->text);
    }
    graph.args.emplace_back(name.text, value->text);
  });
}

/// A name or address without the brackets that one of IPv6 may have; empty if it is neither.
std::string plain_address(std::string text) {
  if (text.starts_with('[') && text.ends_with(']')) text = text.substr(1, text.size() - 2);
  if (text.find_first_of(" /@[]%") != std::string::npos) return {};
  if (text.find(':') == std::string::npos) return text;
  in6_addr ip{};
  std::array<char, INET6_ADDRSTRLEN> plain{};
  if (inet_pton(AF_INET6, text.c_str(), &ip) != 1) return {};
  return inet_ntop(AF_INET6, &ip, plain.data(), plain.size());
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
    const int family = one->ifa_addr != nullptr ? one->ifa_addr->sa_family : AF_UNSPEC;
    const socklen_t size = family == AF_INET6 ? sizeof(sockaddr_in6) : sizeof(sockaddr_in);
    std::array<char, NI_MAXHOST> text{};
    if (family != AF_INET && family != AF_INET6) continue;
    getnameinfo(one->ifa_addr, size, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST);
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
    host.enabled = s.flag("if").value_or(true);
    if (const auto address = s.text("address")) {
      host.address = plain_address(address->text);
      host.here = is_this_machine(host.address);
      if (host.address.empty() && host.enabled) {
        s.mistakes().add(address->place,
                         fmt::format("host '{}': address: expected a name or an address such as "
                                     "10.0.0.2 or fd00::2, without a port, found '{}'",
                                     name.text, address->text));
      }
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

/// Reads a launch file and those that it includes: each in names of its own, which get the
/// namespace when they join the file around.
class FileReader {
 public:
  FileReader(std::string run_log, Mistakes& mistakes)
      : run_log_(std::move(run_log)), mistakes_(mistakes) {}

  /// @throws ConfigError if it is no YAML.
  GraphFile read(const std::string& file, const std::vector<Given>& given) {
    auto known = documents_.find(file);
    if (known == documents_.end()) known = documents_.emplace(file, runtime::read_yaml(file)).first;
    const Yaml& document = known->second;
    GraphFile graph;
    graph.file = file;
    Written all{.name = {},
                .map = &document,
                .path = {},
                .bound = {},
                .variables = runtime::Variables(document)};
    runtime::Variables& variables = all.variables;
    for (const Given& arg : given) variables.bind(arg.name, arg.value);
    variables.set_run("log", run_log_);
    Section top(document, variables, mistakes_);
    // Version first: a newer file may have keys that mean nothing here.
    if (const auto version = top.text("version"); !version || version->text != "1") {
      mistakes_.add(version ? version->place : document.place, "expected version: 1");
      graph.incomplete = true;
      return graph;
    }
    graph.incomplete = !check_given(file, variables, given);
    if (graph.incomplete) return graph;
    graph.clock = top.choice("clock", {"wall", "sim", "lockstep"}).value_or("wall");
    read_args(top, variables, graph, given);
    read_hosts(top, graph);
    NodeSpec defaults;
    top.section("defaults", [&](Section& s) { read_common(s, defaults); });
    const Yaml* nodes = top.take("nodes");
    const bool none = nodes == nullptr || nodes->entries.empty();
    if (none && top.take("groups") == nullptr && top.take("include") == nullptr)
      mistakes_.add(nodes != nullptr ? nodes->place : top.place(), "there are no nodes");
    for (const std::string& key : document.keys()) {  // the order of the file is that of nodes
      if (key == "nodes") read_nodes(top, "nodes", all, defaults, graph, nullptr);
      if (key == "groups") read_groups(top, all, defaults, graph);
      if (key == "include") include(top, graph);
    }
    // Those of included files are there already.
    std::ranges::move(top.texts("outside"), std::back_inserter(graph.outside));
    top.section("result", [&](Section& s) {
      const bool wanted = s.flag("if").value_or(true);
      ResultSpec result = read_result(s);
      if (wanted) graph.result = std::move(result);
    });
    top.take("groups");
    top.take("include");
    top.finish();
    return graph;
  }

 private:
  static constexpr int kMostIncludes = 1000;  // files that include each other twice are 2^depth

  /// The file declares these, and has defaults for all others.
  bool check_given(const std::string& file, const runtime::Variables& variables,
                   const std::vector<Given>& given) {
    const Yaml* declared = documents_.at(file).find("args");
    const auto known = declared != nullptr ? declared->keys() : std::vector<std::string>{};
    for (const Given& arg : given) {
      if (variables.declares(arg.name)) continue;
      mistakes_.add(arg.place, fmt::format("{} declares no argument '{}'{}",
                                           reading_.empty() ? "the file" : file, arg.name,
                                           runtime::did_you_mean(arg.name, known)));
    }
    bool complete = true;
    for (const std::string& name : reading_.empty() ? std::vector<std::string>{} : known) {
      const Yaml* fallback = variables.default_of(name);
      if (variables.args().contains(name) ||
          (fallback != nullptr && fallback->kind == Yaml::Kind::scalar))
        continue;
      complete = false;
      mistakes_.add(reading_.back().place,
                    fmt::format("argument '{}' of {} has no default, expected args: {{{}: VALUE}}",
                                name, file, name));
    }
    return complete;
  }

  void read_nodes(Section& section, const std::string& path, const Written& around,
                  const NodeSpec& base, GraphFile& graph, Group* group) {
    section.entries("nodes", [](const Text&, const Yaml&) {});  // a map
    for (const Written& one : expanded(*section.take("nodes"), path, around, true, graph)) {
      Section s(*one.map, one.variables, mistakes_);
      s.take("for");
      NodeSpec node = read_node(one.name, s, base);
      node.params = graph.file + "#" + one.path + ".params";
      node.given = graph.args;
      node.given.insert(node.given.end(), one.bound.begin(), one.bound.end());
      if (group != nullptr) group->nodes.push_back(node.name.text);
      graph.nodes.push_back(std::move(node));
    }
  }

  std::vector<Written> expanded(const Yaml& map, const std::string& path, const Written& around,
                                bool named, GraphFile& graph) {
    const std::size_t mistakes = mistakes_.size();
    auto all = expand(map, path, around, named, mistakes_);
    graph.incomplete = graph.incomplete || mistakes_.size() > mistakes;
    return all;
  }

  void read_groups(Section& top, const Written& all, const NodeSpec& defaults, GraphFile& graph) {
    top.entries("groups", [](const Text&, const Yaml&) {});  // a map
    for (const Written& one : expanded(*top.take("groups"), "groups", all, false, graph)) {
      Section s(*one.map, one.variables, mistakes_);
      NodeSpec base = defaults;
      read_common(s, base);
      base.enabled = s.flag("if").value_or(true);
      base.after = s.texts("after");
      s.take("for");
      Group group{one.name, {}};
      if (s.take("nodes") != nullptr) {
        read_nodes(s, one.path + ".nodes", one, base, graph, &group);
      } else {
        mistakes_.add(one.name.place, fmt::format("group '{}' has no nodes", one.name.text));
      }
      s.finish();
      join(graph, std::move(group));
    }
  }

  void include(Section& top, GraphFile& graph) {
    const Yaml* list = top.take("include");
    if (list->kind != Yaml::Kind::sequence)
      mistakes_.add(list->place, "expected include as a list, found " + list->described());
    for (const Yaml& item : list->items) {
      Section s(item, top.variables(), mistakes_);
      const auto file = s.text("file");
      const auto name_space = s.text("namespace");
      const bool wanted = s.flag("if").value_or(true);
      std::vector<Given> given;
      s.entries("args", [&](const Text& name, const Yaml& value) {
        if (auto text = s.expand(value, "text"))
          given.push_back({name.text, text->text, name.place});
      });
      s.finish();
      if (item.kind == Yaml::Kind::map && !s.has("file"))
        mistakes_.add(item.place, "an include needs file: FILE");
      if (!file || !may_include(graph.file, *file)) {
        graph.incomplete = true;
        continue;
      }
      GraphFile part;
      try {
        part = read(beside(graph.file, file->text), given);
      } catch (const ConfigError& e) {
        mistakes_.add_line(file->place, e.what());
        graph.incomplete = true;
      }
      reading_.pop_back();
      if (part.file.empty()) continue;
      for (NodeSpec& node : part.nodes) node.enabled = node.enabled && wanted;
      if (!wanted) part.outside.clear();
      if (name_space && check_name(*name_space, "namespace", mistakes_))
        set_namespace(part, name_space->text);
      join(graph, std::move(part), mistakes_);
    }
  }

  static std::string beside(const std::string& file, const std::string& name) {
    return (fs::path(file).parent_path() / name).lexically_normal().string();
  }

  /// It is there, and not being read; then it is being read.
  bool may_include(const std::string& from, const Text& name) {
    const fs::path file = beside(from, name.text);
    std::error_code ignored;
    if (!fs::is_regular_file(file, ignored)) {
      std::vector<std::string> known;
      const fs::path folder = fs::path(name.text).parent_path();
      for (const auto& entry : fs::directory_iterator(file.parent_path(), ignored)) {
        if (entry.path().extension() == ".yaml")
          known.push_back((folder / entry.path().filename()).string());
      }
      mistakes_.add(name.place, fmt::format("there is no file '{}'{}", file.string(),
                                            runtime::did_you_mean(name.text, known)));
      return false;
    }
    reading_.push_back({from, name.place});
    std::string circle;
    for (const Reading& one : reading_) {
      if (circle.empty() && !fs::equivalent(one.file, file, ignored)) continue;
      circle += fmt::format("{}{} includes the next ({})", circle.empty() ? "" : ", ", one.file,
                            to_string(one.place));
    }
    if (circle.empty() && ++includes_ <= kMostIncludes) return true;
    mistakes_.add(name.place, circle.empty() ? "more than 1000 files are included"
                                             : "files include each other: " + circle);
    reading_.pop_back();
    return false;
  }

  struct Reading {
    std::string file;
    runtime::Place place;  ///< of what it includes
  };

  std::string run_log_;
  Mistakes& mistakes_;
  std::map<std::string, Yaml> documents_;
  std::vector<Reading> reading_;  ///< files around the one that is read, the outermost first
  int includes_ = 0;
};

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
  const NodeSpec* found = nullptr;
  for (const NodeSpec& spec : nodes) {
    if (spec.name.text != node || (found != nullptr && !spec.enabled)) continue;
    found = &spec;
    if (spec.enabled) break;
  }
  return found;
}

GraphFile read_graph_file(const std::string& file, const std::vector<std::string>& args,
                          const std::string& run_log, Mistakes& mistakes) {
  std::vector<Given> given;
  for (const std::string& arg : args) {
    try {
      auto [name, value] = runtime::split_assignment(arg, "--arg");
      given.push_back({std::move(name), std::move(value), {"--arg"}});
    } catch (const ConfigError& e) {
      mistakes.add_line({}, e.what());
    }
  }
  GraphFile graph = FileReader(run_log, mistakes).read(file, given);
  open_groups(graph, mistakes);
  check_order(graph, mistakes);
  drop_disabled(graph);
  if (!check_names(graph, mistakes)) graph.incomplete = true;
  return graph;
}

}  // namespace mimesis::launch
