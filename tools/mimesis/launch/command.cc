#include "tools/mimesis/launch/command.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/json_text.h"
#include "common/runtime/keys.h"
#include "tools/mimesis/table.h"

namespace mimesis::launch {
namespace {

namespace fs = std::filesystem;

bool executable(const fs::path& path) {
  std::error_code ignored;
  return fs::is_regular_file(path, ignored) && access(path.c_str(), X_OK) == 0;
}

/// File, arguments and sets of the run, which a recorder keeps so that the run can be started
/// again.
std::string launch_json(const GraphFile& graph, const Run& run) {
  nlohmann::ordered_json json{{"file", graph.file},
                              {"included", graph.included},
                              {"args", nlohmann::json::array()},
                              {"sets", nlohmann::json::array()},
                              {"clock", graph.clock},
                              {"graph", run.graph}};
  for (const auto& [name, value] : graph.args) json["args"].push_back(name + "=" + value);
  for (const auto& [node, set] : run.sets) json["sets"].push_back(node + "." + set);
  return json_text(json);
}

/// systemd-escape(1): what is no letter, digit, ':', '_' or '.' becomes \xNN.
std::string escaped(const std::string& name) {
  std::string text;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    const bool plain = byte < 128 && (std::isalnum(byte) != 0 || c == ':' || c == '_' ||
                                      (c == '.' && !text.empty()));
    text += plain ? std::string(1, c) : fmt::format("\\x{:02x}", byte);
  }
  return text;
}

/// Not a name. Names hold no ':'.
bool is_number(const std::string& address) {
  in_addr ip{};
  return address.find(':') != std::string::npos || inet_pton(AF_INET, address.c_str(), &ip) == 1;
}

/// systemd is the second line: it ends a node that the launcher should have ended long ago.
constexpr int kSecondLine = 5;

}  // namespace

std::string find_executable(const std::string& exec) {
  if (exec.find('/') != std::string::npos) return executable(exec) ? exec : "";
  std::error_code ignored;
  const fs::path beside = fs::read_symlink("/proc/self/exe", ignored).parent_path() / exec;
  if (executable(beside)) return beside.string();
  const char* path = std::getenv("PATH");
  std::istringstream folders(path != nullptr ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (const fs::path file = fs::path(folder) / exec; executable(file)) return file.string();
  }
  return "";
}

std::string bind_address(const GraphFile& graph, const NodeSpec& node) {
  if (!graph.several_hosts()) return {};
  const Host* host = graph.host_of(node);
  // A name is resolved by those who connect; a host that is not declared is where ssh came from.
  std::string address = host != nullptr && is_number(host->address) ? host->address : "0.0.0.0";
  const auto by_ipv6 = [](const Host& h) { return h.address.find(':') != std::string::npos; };
  if (host == nullptr && std::ranges::any_of(graph.hosts, by_ipv6)) address = "::";
  std::string port = "*";
  if (host != nullptr && host->first_port != 0) {
    int before = 0;
    for (const NodeSpec& other : graph.nodes) {
      if (other.name.text == node.name.text) break;
      const bool same = graph.far(other) == graph.far(node);
      before += same ? 1 : 0;
    }
    port = std::to_string(host->first_port + 3 * before);
  }
  return runtime::tcp_at(address) + ":" + port;
}

Command command(const GraphFile& graph, const NodeSpec& node, const Run& run) {
  Command c;
  const bool far = graph.far(node) != nullptr;
  const std::string path = far ? "" : find_executable(node.exec.text);
  c.argv.push_back(path.empty() ? node.exec.text : path);
  for (const Text& arg : node.args) c.argv.push_back(arg.text);
  c.env = node.env;
  c.env.emplace_back("MIMESIS_GRAPH", run.graph);
  c.env.emplace_back("MIMESIS_RUN_LOG", run.log);
  const std::string bind = bind_address(graph, node);
  if (!node.takes_node_options()) {
    if (!bind.empty()) c.env.emplace_back("MIMESIS_BIND", bind);
    c.env.emplace_back("MIMESIS_NODE", node.name.text);
    c.env.emplace_back("MIMESIS_LAUNCH", launch_json(graph, run));
    return c;
  }
  const auto add = [&c](const std::string& option, const std::string& value) {
    c.argv.insert(c.argv.end(), {option, value});
  };
  add("--name", node.name.text);
  add("--graph", run.graph);
  add("--clock", graph.clock);
  if (node.sched.mlock) c.argv.emplace_back("--mlock");
  if (!node.params.empty()) {
    add("--params", far ? fs::absolute(node.params).string() : node.params);
    for (const auto& [name, value] : node.given) add("--arg", name + "=" + value);
  }
  for (const auto& [target, set] : run.sets) {
    if (target == node.name.text) add("--set", set);
  }
  for (const Wire& wire : node.in) {
    const std::string& topic = wire.topic.text;
    if (topic.empty()) continue;
    add("--in", wire.port + "=" + topic);
    const std::string from =
        fmt::format("{}", fmt::join(publishers(graph, topic, node.name.text), ","));
    if (!from.empty()) add("--from", wire.port + "=" + from);
  }
  for (const Wire& wire : node.out) add("--out", wire.port + "=" + wire.topic.text);
  if (!bind.empty()) add("--bind", bind);
  return c;
}

// Those that name it in `out`, and the one that it names (NODE of NODE/PORT) unless that one's PORT
// is wired elsewhere.
std::vector<std::string> publishers(const GraphFile& graph, const std::string& topic,
                                    const std::string& reader) {
  const std::size_t slash = topic.find('/');
  std::vector<std::string> names;
  for (const NodeSpec& node : graph.nodes) {
    bool publishes = slash != std::string::npos && node.name.text == topic.substr(0, slash);
    for (const Wire& wire : node.out) {
      if (publishes && wire.port == topic.substr(slash + 1)) publishes = false;
      if (wire.topic.text == topic) {
        publishes = true;
        break;
      }
    }
    if (publishes && node.name.text != reader) names.push_back(node.name.text);
  }
  return names;
}

std::string slice_name(const std::string& graph) { return "mimesis-" + escaped(graph) + ".slice"; }

std::string unit_name(const std::string& graph, const std::string& node) {
  return "mimesis-" + escaped(graph) + "-" + escaped(node) + ".service";
}

bool notifies(const NodeSpec& node) {
  return node.takes_node_options() &&
         fs::path(node.exec.text).filename().string().starts_with("mimesis_");
}

bool must_live(const NodeSpec& node) {
  return node.hung_after.count() > 0 && (node.required || node.restart.on_failure);
}

Start start_of(const GraphFile& graph, const NodeSpec& node, const Run& run) {
  Start start{.command = command(graph, node, run), .sched = node.sched, .unit = {}, .slice = {}};
  const Host* host = graph.host_of(node);
  if (host == nullptr || host->engine != "systemd") return start;
  start.unit = unit_name(run.graph, node.name.text);
  start.slice = slice_name(run.graph);
  start.notifies = notifies(node);
  start.stop_signal = node.stop.signal;
  start.stop_timeout = node.stop.timeout;
  if (start.notifies && must_live(node)) start.watchdog = kSecondLine * node.hung_after;
  return start;
}

Command ssh(const Host& host, const std::string& line, const std::vector<std::string>& more) {
  Command c{{"ssh", "-T", "-o", "BatchMode=yes", "-o", "ConnectTimeout=5"}, {}};
  c.argv.insert(c.argv.end(), more.begin(), more.end());
  c.argv.insert(c.argv.end(), {host.target(), "--", line});
  return c;
}

Command command_from_here(const GraphFile& graph, const NodeSpec& node, const Run& run,
                          const std::vector<std::string>& ssh_options) {
  Command c = command(graph, node, run);
  const Host* host = graph.far(node);
  if (host == nullptr) return c;
  std::string line = "exec env";
  for (const auto& [name, value] : c.env) line += " " + name + "=" + tool::shell_word(value);
  if (c.argv[0].find('/') == std::string::npos) c.argv[0] = host->prefix + "/bin/" + c.argv[0];
  for (const std::string& word : c.argv) line += " " + tool::shell_word(word);
  return ssh(*host, line, ssh_options);
}

GraphFile with_clock(GraphFile graph) {
  if (graph.clock == "wall") return graph;
  NodeSpec clock;
  clock.name.text = "clock";
  clock.exec.text = "mimesis_clock";
  clock.required = true;
  clock.stop.last = true;
  std::string participants;
  for (NodeSpec& node : graph.nodes) {
    if (!node.takes_node_options()) continue;
    participants += (participants.empty() ? "" : ",") + node.name.text;
    node.after.push_back(clock.name);
  }
  std::vector<std::string> sets = {"mode=" + graph.clock, "participants=" + participants};
  if (graph.clock == "sim")
    sets.push_back("factor=1");  // real time, unless --set clock.factor says else
  for (const std::string& set : sets) {
    clock.args.push_back({"--set", {}});
    clock.args.push_back({set, {}});
  }
  graph.nodes.insert(graph.nodes.begin(), clock);
  return graph;
}

std::string shell_line(const Command& command) {
  std::string line;
  for (const auto& [name, value] : command.env) line += name + "=" + tool::shell_word(value) + " ";
  for (std::size_t i = 0; i < command.argv.size(); ++i)
    line += (i > 0 ? " " : "") + tool::shell_word(command.argv[i]);
  return line;
}

}  // namespace mimesis::launch
