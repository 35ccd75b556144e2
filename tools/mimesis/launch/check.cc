#include <fmt/format.h>
#include <google/protobuf/descriptor.h>
#include <poll.h>
#include <sched.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <sstream>

#include "common/runtime/own_topics.h"
#include "common/runtime/raw.h"
#include "common/runtime/value_text.h"
#include "tools/mimesis/field_text.h"
#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/process.h"

namespace mimesis::launch {
namespace {

namespace fs = std::filesystem;
using runtime::did_you_mean;
using Json = nlohmann::json;

constexpr std::chrono::milliseconds kAnswer{10'000};  // in its own check a node may learn or paint

constexpr std::chrono::seconds kSshEnd{2};
constexpr std::size_t kSshSuffix = 18;  // ssh binds the socket under a longer name first

/// What the user's configuration says of a host, before anything is connected.
Command configuration(const Host& host) { return {{"ssh", "-G", host.target()}, {}}; }

bool shares_already(const std::string& configuration) {
  return ("\n" + configuration).find("\ncontrolpath ") != std::string::npos;
}

/// One ssh connection to each of some hosts, which further calls of ssh share (ControlMaster), in
/// sockets of a folder of this process that is removed at the end. A host for which the user's
/// configuration names a ControlPath is left to that.
class SshMasters {
 public:
  /// Begins to connect. @param folder  parent of its folder, for instance of graphs
  SshMasters(const std::vector<const Host*>& hosts, const std::string& folder);
  ~SshMasters();
  SshMasters(const SshMasters&) = delete;
  SshMasters& operator=(const SshMasters&) = delete;

  /// Options by which ssh uses the connection, once it stands; none: it uses one of its own.
  std::vector<std::string> options(const Host& host);
  /// Why there is no connection; empty: there is, or nobody has asked for one.
  std::string failure(const Host& host);

 private:
  struct Master {
    std::string socket;
    std::unique_ptr<OwnProcess> ssh;
  };
  /// Waits until it stands or has failed.
  Master* find(const Host& host);

  std::string folder_;
  std::map<std::string, Master> masters_;  ///< by target
};

SshMasters::SshMasters(const std::vector<const Host*>& hosts, const std::string& folder) {
  if (hosts.empty()) return;
  folder_ = folder + "/ssh-XXXXXX";
  if (mkdtemp(folder_.data()) == nullptr) folder_.clear();
  if (folder_.empty() || folder_.size() + 4 + kSshSuffix >= sizeof sockaddr_un{}.sun_path) return;
  std::vector<std::unique_ptr<OwnProcess>> asked;
  for (const Host* host : hosts)
    asked.push_back(std::make_unique<OwnProcess>(configuration(*host)));
  for (std::size_t i = 0; i < hosts.size(); ++i) {
    if (!asked[i]->wait(kSshEnd) || shares_already(asked[i]->last_words(1 << 16))) continue;
    Master& master = masters_[hosts[i]->target()];
    if (master.ssh) continue;
    master.socket = fmt::format("{}/{}", folder_, i);
    Command c = ssh(*hosts[i], "", {"-o", "ControlPersist=no", "-N", "-M", "-S", master.socket});
    c.argv.resize(c.argv.size() - 2);  // no command
    master.ssh = std::make_unique<OwnProcess>(c);
  }
}

SshMasters::~SshMasters() {
  for (auto& [target, master] : masters_) master.ssh->send(SIGTERM);
  for (auto& [target, master] : masters_) master.ssh->wait(kSshEnd);
  std::error_code ignored;
  if (!folder_.empty()) std::filesystem::remove_all(folder_, ignored);
}

SshMasters::Master* SshMasters::find(const Host& host) {
  const auto found = masters_.find(host.target());
  if (found == masters_.end()) return nullptr;
  Master& master = found->second;
  // ssh has a time-out of its own.
  while (!master.ssh->ending() && access(master.socket.c_str(), F_OK) != 0) poll(nullptr, 0, 2);
  return &master;
}

std::vector<std::string> SshMasters::options(const Host& host) {
  const Master* master = find(host);
  if (master == nullptr || master->ssh->ending()) return {};
  return {"-S", master->socket};
}

std::string SshMasters::failure(const Host& host) {
  const Master* master = find(host);
  if (master == nullptr || !master->ssh->ending()) return {};
  return fmt::format("host '{}' cannot be used: ssh {}: {}", host.name.text,
                     master->ssh->ending()->text(), master->ssh->last_words());
}

struct Port {
  std::string name, type;
  bool input = false, optional = false, sole = false, own = false;
};

/// A bus or device that a node opens.
struct Opened {
  const NodeSpec* node = nullptr;
  std::string kind, address, role, of, line_start;  ///< "FILE:LINE:COL: NODE.PARAMETER: "
  runtime::Place near;
};

/// A node's description of itself.
struct Description {
  std::vector<Port> ports;
  std::vector<Opened> opened;

  const Port* find(const std::string& name, bool input) const {
    const auto port = std::ranges::find_if(
        ports, [&](const Port& p) { return p.name == name && p.input == input; });
    return port != ports.end() ? &*port : nullptr;
  }
  std::vector<std::string> names(bool input) const {
    std::vector<std::string> all;
    for (const Port& port : ports) {
      if (port.input == input && !port.own) all.push_back(port.name);
    }
    return all;
  }
};

/// By node; absent: it did not answer, or is not asked.
using Descriptions = std::map<std::string, Description>;

/// The line and column in "FILE:LINE:COL...".
runtime::Place place_in(const std::string& line, const std::string& file) {
  runtime::Place place{file};
  if (line.starts_with(file + ":"))
    std::sscanf(line.c_str() + file.size(), ":%d:%d", &place.line, &place.column);
  return place;
}

Description read_description(const Json& json, const NodeSpec& node, const std::string& file) {
  Description d;
  for (const Json& port : json.at("ports")) {
    d.ports.push_back({.name = port.at("name"),
                       .type = port.at("type"),
                       .input = port.at("direction") == "in",
                       .optional = port.value("optional", false),
                       .sole = port.value("sole", false),
                       .own = port.value("own", false)});
  }
  for (const Json& opened : json.at("opens")) {
    const std::string place = opened.at("place"), parameter = opened.at("parameter");
    d.opened.push_back({&node, opened.at("kind"), opened.at("address"), opened.value("role", ""),
                        opened.value("of", ""),
                        fmt::format("{}: {}.{}: ", place, node.name.text, parameter),
                        place_in(place, file)});
  }
  return d;
}

/// Asks the nodes, as many of a host at a time as this machine has CPUs and one more; those of
/// other hosts, through ssh, only in a whole check.
class Questions {
 public:
  Questions(const GraphFile& graph, const Run& run, bool whole, Mistakes& mistakes)
      : graph_(graph), mistakes_(mistakes) {
    const auto is_asked = [&](const NodeSpec& node) {
      if (!whole) return graph.far(node) == nullptr && notifies(node);
      return node.takes_node_options();
    };
    std::vector<const Host*> hosts;  // that are asked more than once
    for (const Host& host : graph.hosts) {
      const auto of_host = [&](const NodeSpec& n) { return graph.far(n) == &host && is_asked(n); };
      if (std::ranges::count_if(graph.nodes, of_host) > 1) hosts.push_back(&host);
    }
    const std::string directory = hosts.empty() ? "" : runtime::graph_directory(run.graph);
    SshMasters masters(hosts, fs::path(directory).parent_path());
    const auto most = sysconf(_SC_NPROCESSORS_ONLN) + 1;
    const auto asks = [this](const Host* host) {
      return std::ranges::count(asked_, host, [&](const Asked& a) { return graph_.far(a.node); });
    };
    // Connections to other hosts are made while the nodes of this one are asked.
    for (const bool far : {false, true}) {
      for (const NodeSpec& node : graph.nodes) {
        const Host* host = graph.far(node);
        if ((host != nullptr) != far || !is_asked(node)) continue;
        Command c = command_from_here(graph, node, run,
                                      far ? masters.options(*host) : std::vector<std::string>());
        if (const std::string why = far ? masters.failure(*host) : ""; !why.empty()) {
          mistakes.add(host->name.place, why);
          continue;
        }
        if (find_executable(c.argv[0]).empty()) continue;
        c.argv.push_back("--describe");
        if (whole) c.argv.push_back("--check");
        while (asks(host) >= most) hear();
        asked_.emplace_back(node, c);
      }
    }
    while (!asked_.empty()) hear();
  }
  const Descriptions& answers() const { return answers_; }

 private:
  struct Asked {
    Asked(const NodeSpec& spec, const Command& command) : node(spec), process(command) {}
    const NodeSpec& node;
    OwnProcess process;
  };

  void hear() {
    Asked& asked = asked_.front();
    const NodeSpec& node = asked.node;
    const bool in_time = asked.process.wait(kAnswer);
    const Ending ending = asked.process.ending().value_or(Ending{});
    std::istringstream lines(asked.process.last_words(1 << 20));
    bool any = false;
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with("{\"program\":")) {
        try {
          const Json json = Json::parse(line);
          if (json.at("complete"))
            answers_[node.name.text] = read_description(json, node, node.name.place.file);
        } catch (const Json::exception&) {  // a program of another version: as if it did not answer
        }
      } else if (line.find("unknown option '--describe'") != std::string::npos) {
        any = true;
        mistakes_.warn(node.name.place, fmt::format("node '{}' does not know --describe: its ports "
                                                    "are not checked",
                                                    node.name.text));
      } else if (!line.empty() && !ending.good()) {
        any = true;
        const runtime::Place place = place_in(line, node.name.place.file);
        mistakes_.add_line(place.line > 0 ? place : node.name.place, line);
      }
    }
    if (!in_time) {
      mistakes_.add_line(node.name.place,
                         fmt::format("{}: node '{}': no answer within {} ms of a quiet machine",
                                     to_string(node.name.place), node.name.text, kAnswer.count()));
    } else if (ending.signal != 0 || (!ending.good() && !any)) {
      mistakes_.add(node.name.place,
                    fmt::format("node '{}': its check {}", node.name.text, ending.text()));
    }
    asked_.pop_front();
  }

  const GraphFile& graph_;
  Mistakes& mistakes_;
  std::deque<Asked> asked_;
  Descriptions answers_;
};

/// A topic of the graph; `type` is empty if nobody described the publisher.
struct Topic {
  std::string name, port, type;
  const NodeSpec* node = nullptr;
};

class Wiring {
 public:
  Wiring(const GraphFile& graph, const Descriptions& described, Mistakes& mistakes)
      : graph_(graph), described_(described), mistakes_(mistakes) {
    for (const NodeSpec& node : graph.nodes) add_topics(node);
    for (const Text& topic : graph.outside) topics_.push_back({topic.text, "", "", nullptr});
  }

  void check() {
    check_types_agree();
    for (const NodeSpec& node : graph_.nodes) {
      const auto description = described_.find(node.name.text);
      if (description != described_.end()) {
        check_ports(node, description->second);
      } else {
        for (const Wire& wire : node.in) {
          if (!wire.topic.text.empty()) demand(wire.topic);
        }
      }
    }
    if (graph_.result) check_result(*graph_.result);
  }

 private:
  void add_topics(const NodeSpec& node) {
    for (const Wire& wire : node.out) topics_.push_back({wire.topic.text, wire.port, "", &node});
    const auto description = described_.find(node.name.text);
    if (description == described_.end()) return;
    for (const Port& port : description->second.ports) {
      if (port.input) continue;
      const auto wire = std::ranges::find(node.out, port.name, &Wire::port);
      if (wire == node.out.end()) {
        topics_.push_back({node.name.text + "/" + port.name, port.name, port.type, &node});
      } else {
        for (Topic& topic : topics_) {
          if (topic.node == &node && topic.port == port.name) topic.type = port.type;
        }
      }
    }
  }

  /// A node that nobody described may publish any NODE/PORT.
  bool may_publish(const std::string& topic) const {
    const NodeSpec* node = graph_.find(topic.substr(0, topic.find('/')));
    return node != nullptr && topic.find('/') != std::string::npos && !node->records() &&
           !described_.contains(node->name.text);
  }
  bool disabled(const std::string& topic) const {
    return std::ranges::any_of(graph_.disabled, [&](const NodeSpec& node) {
      return topic.starts_with(node.name.text + "/") ||
             std::ranges::any_of(node.out,
                                 [&](const Wire& wire) { return wire.topic.text == topic; });
    });
  }
  const Topic* find(const std::string& name) const {
    const auto topic = std::ranges::find(topics_, name, &Topic::name);
    return topic != topics_.end() ? &*topic : nullptr;
  }

  /// The likeliest topic: of the right type with a similar name, else any similar one, else the
  /// only one of the right type.
  std::string suggestion(const std::string& topic, const std::string& type,
                         const NodeSpec* reader) const {
    std::vector<std::string> all, fitting;
    std::set<std::string> typed;
    for (const Topic& t : topics_) {
      const bool own = t.node != nullptr && (t.node == reader || runtime::is_own_topic(t.name));
      if (topic.starts_with(t.name + ".")) return ", did you mean '" + t.name + "'?";
      if (t.name == topic || own) continue;
      all.push_back(t.name);
      if (!type.empty() && t.type == type) typed.insert(t.name);
    }
    fitting.assign(typed.begin(), typed.end());
    const std::size_t slash = std::min(topic.find('/'), topic.size());
    for (const NodeSpec& node : graph_.nodes) {
      const std::string named = node.name.text + topic.substr(slash);
      if (named == topic || !may_publish(named)) continue;
      all.push_back(named);
      fitting.push_back(named);
    }
    std::string text = did_you_mean(topic, fitting);
    if (text.empty()) text = did_you_mean(topic, all);
    if (text.empty() && typed.size() == 1) text = ", did you mean '" + *typed.begin() + "'?";
    return text;
  }

  /// A topic that somebody publishes, of this type if it is not empty.
  void demand(const Text& topic, const std::string& type = "", const NodeSpec* reader = nullptr,
              bool optional = false) {
    const Topic* found = find(topic.text);
    if (found == nullptr) {
      if (may_publish(topic.text) || (optional && disabled(topic.text))) return;
      const std::string expected = type.empty() ? "" : ", expected one with " + type;
      mistakes_.add(topic.place, fmt::format("no node publishes '{}'{}{}", topic.text, expected,
                                             suggestion(topic.text, type, reader)));
    } else if (!type.empty() && !found->type.empty() && found->type != type) {
      mistakes_.add(topic.place,
                    fmt::format("'{}' carries {}, expected {}{}", topic.text, found->type, type,
                                suggestion(topic.text, type, reader)));
    }
  }

  /// Publishers of one topic.
  void check_types_agree() {
    for (const NodeSpec& node : graph_.nodes) {
      for (const Wire& wire : node.out) {
        const Topic* first = find(wire.topic.text);
        for (const Topic& other : topics_) {
          if (other.node != &node || other.port != wire.port || other.type == first->type ||
              other.type.empty() || first->type.empty())
            continue;
          mistakes_.add(wire.topic.place,
                        fmt::format("'{}' carries {} of node '{}', expected that "
                                    "instead of {}",
                                    first->name, first->type, first->node->name.text, other.type));
        }
      }
    }
  }

  void check_ports(const NodeSpec& node, const Description& description) {
    for (const bool input : {true, false}) {
      for (const Wire& wire : input ? node.in : node.out) {
        if (description.find(wire.port, input) == nullptr)
          report_port(node, description, wire, input);
      }
    }
    for (const Port& port : description.ports) {
      if (!port.input) continue;
      const auto wire = std::ranges::find(node.in, port.name, &Wire::port);
      if (wire == node.in.end()) {
        if (!port.optional) report_left_out(node, port);
        continue;
      }
      if (wire->topic.text.empty()) continue;
      demand(wire->topic, port.type, &node, port.optional);
      if (port.sole) check_sole(node, *wire);
    }
  }

  void report_port(const NodeSpec& node, const Description& description, const Wire& wire,
                   bool input) {
    const auto known = description.names(input);
    std::string what = fmt::format("node '{}' has no {} '{}'", node.name.text,
                                   input ? "input" : "output", wire.port);
    if (description.find(wire.port, !input) != nullptr)
      what += fmt::format(" (it is an {})", input ? "output" : "input");
    what +=
        known.empty() ? ", expected none" : fmt::format(", expected {}", fmt::join(known, ", "));
    mistakes_.add(wire.place, what + did_you_mean(wire.port, known));
  }

  void report_left_out(const NodeSpec& node, const Port& port) {
    mistakes_.add(node.name.place,
                  fmt::format("node '{}': input '{}' is left out, expected in: {{{}: a topic with "
                              "{}}}{}",
                              node.name.text, port.name, port.name, port.type,
                              suggestion(node.name.text + "/" + port.name, port.type, &node)));
  }

  void check_sole(const NodeSpec& node, const Wire& wire) {
    std::vector<std::string> names;
    for (const Topic& topic : topics_) {
      if (topic.name == wire.topic.text && topic.node != nullptr && topic.node != &node)
        names.push_back(topic.node->name.text);
    }
    if (names.size() > 1) {
      mistakes_.add(wire.topic.place,
                    fmt::format("this input obeys one node, and the topic is published by {}",
                                fmt::join(names, ",")));
    }
  }

  void check_result(const ResultSpec& result) {
    if (!result.until.text.empty()) demand(result.until);
    std::vector<FieldPath> paths;
    for (const ResultField& field : result.fields) paths.push_back(field.from);
    if (result.success) {
      const auto* success = check_field(*result.success);
      if (success != nullptr && success->type() != google::protobuf::FieldDescriptor::TYPE_BOOL) {
        mistakes_.add(result.success->place,
                      fmt::format("success: '{}' is of type {}, expected a bool",
                                  result.success->field, success->type_name()));
      }
    }
    for (const FieldPath& path : paths) check_field(path);
  }

  /// Null: its type is not known here, or it is a mistake.
  const google::protobuf::FieldDescriptor* check_field(const FieldPath& path) {
    demand({path.topic, path.place});
    const Topic* topic = find(path.topic);
    if (topic == nullptr) return nullptr;
    const auto* type =
        google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(topic->type);
    if (type == nullptr) return nullptr;
    try {
      return &tool::FieldPath(*type, path.field).leaf();
    } catch (const ConfigError& e) {
      mistakes_.add(path.place, e.what());
      return nullptr;
    }
  }

  const GraphFile& graph_;
  const Descriptions& described_;
  Mistakes& mistakes_;
  std::vector<Topic> topics_;
};

/// What two nodes that open the same bus of a host say of it: one alone is its master, and both
/// know the same drives.
void check_shared_bus(const Opened& one, const Opened& other, Mistakes& mistakes) {
  if (one.role == "master" && other.role == "master") {
    mistakes.add_line(one.near, fmt::format("{}node '{}' is master of '{}', too: a bus has one",
                                            one.line_start, other.node->name.text, one.address));
  } else if (!one.of.empty() && !other.of.empty() && one.of != other.of) {
    mistakes.add_line(one.near,
                      fmt::format("{}'{}' carries {}, and node '{}' has there {}", one.line_start,
                                  one.address, one.of, other.node->name.text, other.of));
  }
}

/// A simulated bus joins nodes of the graph: one that has a single end is misspelt.
void check_buses(const GraphFile& graph, const Descriptions& described, Mistakes& mistakes) {
  std::vector<const Opened*> all;
  for (const auto& [node, description] : described) {
    for (const Opened& opened : description.opened) all.push_back(&opened);
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const Opened &one = *all[i], &other = *all[j];
      const bool same = one.node != other.node && one.kind == other.kind &&
                        one.address == other.address &&
                        graph.far(*one.node) == graph.far(*other.node);
      if (same) check_shared_bus(one, other, mistakes);
    }
  }
  for (const Opened* one : all) {
    if (!one->address.starts_with("embedded:") && !one->address.starts_with("unix:")) continue;
    bool met = false;
    std::vector<std::string> others;
    for (const Opened* other : all) {
      if (other->node == one->node || other->kind != one->kind) continue;
      met = met || other->address == one->address;
      others.push_back(other->address);
    }
    if (met || others.empty()) continue;
    mistakes.add_line(
        one->near,
        fmt::format("{}no other node is on '{}', expected one of {}{}", one->line_start,
                    one->address, fmt::join(std::set(others.begin(), others.end()), ", "),
                    did_you_mean(one->address, others)));
  }
}

void check_host(const GraphFile& graph, const NodeSpec& node, Mistakes& mistakes) {
  if (!node.host) return;
  std::vector<std::string> known;
  for (const Host& host : graph.hosts) known.push_back(host.name.text);
  if (std::ranges::find(known, node.host->text) != known.end()) return;
  mistakes.add(node.host->place, fmt::format("there is no host '{}'{}", node.host->text,
                                             did_you_mean(node.host->text, known)));
}

/// Lock-step waits at every step for every node: that is for one machine.
void check_lockstep(const GraphFile& file, Mistakes& mistakes) {
  for (const NodeSpec& node : file.nodes) {
    if (file.clock != "lockstep" || file.far(node) == nullptr) continue;
    mistakes.add(node.host->place,
                 fmt::format("clock lockstep stays on one host, and node '{}' is on '{}', expected "
                             "clock wall or sim",
                             node.name.text, node.host->text));
    return;
  }
}

void check_program(const NodeSpec& node, Mistakes& mistakes) {
  if (node.exec.text.empty() || !find_executable(node.exec.text).empty()) return;
  std::vector<std::string> known;
  std::error_code ignored;
  const fs::path beside = fs::read_symlink("/proc/self/exe", ignored).parent_path();
  for (const auto& entry : fs::directory_iterator(beside, ignored)) {
    const std::string name = entry.path().filename();
    if (name.starts_with("mimesis_")) known.push_back(name);
  }
  mistakes.add(node.exec.place,
               fmt::format("node '{}': there is no program '{}' beside mimesis or on PATH{}",
                           node.name.text, node.exec.text, did_you_mean(node.exec.text, known)));
}

void check_cpus(const NodeSpec& node, Mistakes& mistakes) {
  cpu_set_t ours;
  if (node.sched.cpus.empty() || sched_getaffinity(0, sizeof ours, &ours) != 0) return;
  std::vector<int> known;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (CPU_ISSET(cpu, &ours)) known.push_back(cpu);
  }
  for (const int cpu : node.sched.cpus) {
    if (std::ranges::find(known, cpu) != known.end()) continue;
    mistakes.add(node.sched.place,
                 fmt::format("node '{}': cpus: this machine has no CPU {}, expected some of {}",
                             node.name.text, cpu, fmt::join(known, ", ")));
  }
}

void check_sets(const GraphFile& graph, const Run& run, Mistakes& mistakes) {
  std::vector<std::string> known = {"clock"};
  for (const NodeSpec& node : graph.nodes) known.push_back(node.name.text);
  for (const auto& [target, set] : run.sets) {
    if (std::ranges::find(known, target) != known.end()) continue;
    mistakes.add({"--set"}, fmt::format("{}.{}: there is no node '{}'{}", target, set, target,
                                        did_you_mean(target, known)));
  }
}

}  // namespace

void check_graph(const GraphFile& file, const Run& run, bool whole, Mistakes& mistakes) {
  if (file.incomplete) return;  // each wire to a missing node would be another mistake
  if (file.clock != "wall" && find_executable("mimesis_clock").empty()) {
    mistakes.add({file.file},
                 "clock " + file.clock + " needs the program mimesis_clock beside mimesis");
  }
  for (const NodeSpec& node : file.nodes) {
    if (node.name.text == "clock" && node.name.place.line > 0 && file.clock != "wall") {
      mistakes.add(node.name.place,
                   "the name 'clock' belongs to the node that the launcher starts");
    }
    check_host(file, node, mistakes);
    if (file.far(node) != nullptr) continue;
    check_program(node, mistakes);
    check_cpus(node, mistakes);
  }
  check_lockstep(file, mistakes);
  check_sets(file, run, mistakes);
  const GraphFile graph = with_clock(file);
  const Questions questions(graph, run, whole, mistakes);
  Wiring(graph, questions.answers(), mistakes).check();
  if (whole) check_buses(graph, questions.answers(), mistakes);
}

}  // namespace mimesis::launch
