#include "tools/mimesis/launch/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "common/error.h"
#include "common/runtime/value_text.h"

namespace mimesis::launch {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kHeader = "# Written by mimesis launch export";
constexpr char kBoot = '\x01';  // stands for the id of the boot until the text is written

/// A word of `Environment=`, or of `ExecStart=`, in which `$` would begin a variable.
std::string quoted(const std::string& text, bool command) {
  std::string word;
  for (const char c : text) {
    if (c == kBoot) {
      word += "%b";
    } else if (c == '"' || c == '\\') {
      word += {'\\', c};
    } else if (c == '%' || (c == '$' && command)) {
      word += {c, c};
    } else if (static_cast<unsigned char>(c) < 32) {
      word += fmt::format("\\x{:02x}", c);
    } else {
      word += c;
    }
  }
  return "\"" + word + "\"";
}

/// systemd's own variables of a description or a comment stay text.
std::string plain(const std::string& text) {
  std::string line;
  for (const char c : text) {
    line += static_cast<unsigned char>(c) < 32 ? ' ' : c;
    if (c == '%') line += c;
  }
  return line;
}

std::string ms(nanoseconds time) {
  return fmt::format("{}ms", std::chrono::ceil<std::chrono::milliseconds>(time).count());
}

/// Writes one unit file.
class UnitText {
 public:
  explicit UnitText(const GraphFile& graph)
      : text_(fmt::format("{} from {}\n", kHeader, plain(graph.file))) {}
  void section(const char* name) { text_ += fmt::format("\n[{}]\n", name); }
  void set(const char* key, const std::string& value) {
    if (!value.empty()) text_ += fmt::format("{}={}\n", key, value);
  }
  std::string text() const { return text_; }

 private:
  std::string text_;
};

class Export {
 public:
  Export(const GraphFile& graph, const Run& run)
      : graph_(graph), run_(run), target_(stem() + ".target"), end_(stem() + ".end.target") {}

  BootUnits units() {
    // As for nodes, a restart must not be passed on, here to all of them.
    std::string required, others;
    bool any_required = false;
    for (const NodeSpec& node : graph_.nodes) {
      const std::string unit = name(node.name.text);
      std::string& names = node.required && !node.restart.on_failure ? required : others;
      names += (names.empty() ? "" : " ") + unit;
      any_required = any_required || node.required;
      units_.files[unit] = service(node);
      if (node.restart.on_failure && node.restart.backoff > 1.0) backoff_ += " " + node.name.text;
    }
    UnitText target(graph_);
    target.section("Unit");
    target.set("Description", "Mimesis graph " + plain(run_.graph));
    target.set("Documentation", "man:mimesis-launch(1)");
    target.set("Requires", required);
    target.set("Wants", others);
    target.set("After", all());
    target.section("Install");
    target.set("WantedBy", "multi-user.target");
    units_.files[target_] = target.text();
    if (any_required) units_.files[end_] = ender();
    if (graph_.result)
      units_.notes.emplace_back("result: is left out: the nodes run until they are stopped");
    if (!backoff_.empty())
      units_.notes.push_back(fmt::format(
          "restart.backoff is left out: systemd waits equally long before each restart of{}",
          backoff_));
    return units_;
  }

 private:
  std::string stem() const {
    const std::string slice = slice_name(run_.graph);
    return slice.substr(0, slice.rfind('.'));
  }
  std::string name(const std::string& node) const { return unit_name(run_.graph, node); }
  std::string all() const {
    std::string names;
    for (const NodeSpec& node : graph_.nodes)
      names += (names.empty() ? "" : " ") + name(node.name.text);
    return names;
  }
  /// Its start, by the end of a required node, stops all.
  std::string ender() const {
    UnitText end(graph_);
    end.section("Unit");
    end.set("Description", "A required node of Mimesis graph " + plain(run_.graph) + " has ended");
    end.set("Conflicts", target_ + " " + all());
    return end.text();
  }

  /// Nodes that this one stops before: those it comes after, and, of one that does not stop last,
  /// those that do. systemd stops in the reverse of the order of start, so it waits for these, too.
  std::string after(const NodeSpec& node) const {
    std::set<std::string> last, names;
    for (const NodeSpec& other : graph_.nodes) {
      if (other.stop.last) add_before(other, last);
    }
    for (const Text& before : node.after) names.insert(before.text);
    if (!last.contains(node.name.text)) names.insert(last.begin(), last.end());
    std::string units = "network-online.target";
    for (const std::string& before : names) units += " " + name(before);
    return units;
  }
  void add_before(const NodeSpec& node, std::set<std::string>& names) const {
    if (!names.insert(node.name.text).second) return;
    for (const Text& before : node.after) {
      if (const NodeSpec* other = graph_.find(before.text)) add_before(*other, names);
    }
  }

  std::string service(const NodeSpec& node) const {
    UnitText unit(graph_);
    unit.section("Unit");
    unit.set("Description",
             fmt::format("Mimesis node {} of graph {}", plain(node.name.text), plain(run_.graph)));
    unit.set("PartOf", target_);
    unit.set("After", after(node));
    // A restart of what is required would restart this one, too.
    std::string required, wanted = "network-online.target";
    for (const Text& before : node.after) {
      const bool again = graph_.find(before.text)->restart.on_failure;
      std::string& names = again ? wanted : required;
      names += (names.empty() ? "" : " ") + name(before.text);
    }
    unit.set("Requires", required);
    unit.set("Wants", wanted);
    if (node.required) {
      unit.set("OnFailure", end_);
      unit.set("OnSuccess", end_);
    }
    if (node.restart.on_failure) {
      unit.set("StartLimitIntervalSec", ms(node.restart.window));
      unit.set("StartLimitBurst", std::to_string(node.restart.max + 1));
    }
    unit.section("Service");
    unit.set("Type", notifies(node) ? "notify" : "exec");
    unit.set("Slice", slice_name(run_.graph));
    unit.set("User", "mimesis");
    set_command(node, unit);
    unit.set("RuntimeDirectory", "mimesis");
    unit.set("RuntimeDirectoryPreserve", "yes");
    unit.set("StateDirectory", "mimesis mimesis/log " + state_folder());
    if (node.restart.on_failure) {
      unit.set("Restart", "on-failure");
      unit.set("RestartSec", ms(node.restart.delay));
    }
    if (notifies(node)) unit.set("TimeoutStartSec", ms(node.ready_within));
    if (notifies(node) && must_live(node)) unit.set("WatchdogSec", ms(node.hung_after));
    unit.set("KillMode", "mixed");
    unit.set("KillSignal", node.stop.signal == SIGTERM ? "SIGTERM" : "SIGINT");
    unit.set("TimeoutStopSec", ms(node.stop.timeout));
    set_schedule(node.sched, unit);
    return unit.text();
  }
  /// Under /var/lib.
  std::string state_folder() const {
    std::string folder = run_.log.substr(std::string_view("/var/lib/").size());
    folder = quoted(folder, false);
    return folder.substr(1, folder.size() - 2);  // a graph's name has no blanks
  }

  void set_command(const NodeSpec& node, UnitText& unit) const {
    const Command c = command(graph_, node, run_);
    for (const char* folder :
         {"XDG_RUNTIME_DIR=/run", "XDG_CONFIG_HOME=/etc", "XDG_STATE_HOME=/var/lib"})
      unit.set("Environment", folder);
    for (const auto& [variable, value] : c.env)
      unit.set("Environment", quoted(variable + "=" + value, false));
    std::string line;
    for (const std::string& word : c.argv) line += (line.empty() ? "" : " ") + quoted(word, true);
    unit.set("ExecStart", line);
  }

  static void set_schedule(const Sched& sched, UnitText& unit) {
    if (sched.policy != "other") {
      unit.set("CPUSchedulingPolicy", sched.policy);
      unit.set("CPUSchedulingPriority", std::to_string(sched.priority));
      unit.set("LimitRTPRIO", std::to_string(sched.priority));
    }
    unit.set("CPUAffinity", fmt::format("{}", fmt::join(sched.cpus, " ")));
    if (sched.mlock) unit.set("LimitMEMLOCK", "infinity");
  }

  const GraphFile& graph_;
  const Run& run_;
  std::string target_, end_, backoff_;
  BootUnits units_;
};

/// Leaves the nodes of one host, as if the file had no others. @throws ConfigError
void keep_host(GraphFile& graph, const std::string& name) {
  std::vector<std::string> known;
  for (const Host& host : graph.hosts) known.push_back(host.name.text);
  const auto host =
      std::ranges::find_if(graph.hosts, [&](const Host& h) { return h.name.text == name; });
  if (!name.empty() && host == graph.hosts.end())
    throw ConfigError("--host: the file declares no host '" + name + "'" +
                      runtime::did_you_mean(name, known));
  const Host* chosen = name.empty() || host->here ? nullptr : &*host;
  const auto ours = [&](const NodeSpec& node) { return graph.far(node) == chosen; };
  for (NodeSpec& node : graph.nodes) {
    if (!ours(node)) continue;
    for (const Wire& wire : node.in) {
      for (const std::string& from : publishers(graph, wire.topic.text, node.name.text)) {
        if (!ours(*graph.find(from)))
          throw ConfigError(
              fmt::format("{}: node '{}' hears '{}' on another host, which takes the launcher; let "
                          "mimesis@NAME start it",
                          to_string(wire.place), node.name.text, from));
      }
    }
    for (const Text& before : node.after) {
      if (!ours(*graph.find(before.text)))
        throw ConfigError(
            fmt::format("{}: node '{}' comes after '{}' on another host, which takes the launcher; "
                        "let mimesis@NAME start it",
                        to_string(before.place), node.name.text, before.text));
    }
    if (chosen != nullptr && node.exec.text.find('/') == std::string::npos)
      node.exec.text = chosen->prefix + "/bin/" + node.exec.text;
  }
  std::erase_if(graph.nodes, [&](const NodeSpec& node) { return !ours(node); });
  graph.hosts.clear();
  if (graph.nodes.empty())
    throw ConfigError(name.empty()
                          ? "no node of the file runs on this machine; expected --host NAME"
                          : "no node of the file runs on host '" + name + "'");
}

std::string content(const fs::path& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

}  // namespace

std::string boot_log(const std::string& graph) {
  return "/var/lib/mimesis/log/" + graph + "-" + kBoot;
}

BootUnits boot_units(GraphFile graph, const Run& run, const std::string& host) {
  if (graph.clock == "lockstep")
    throw ConfigError(
        "clock: lockstep computes a run that the launcher ends; expected wall or sim");
  keep_host(graph, host);
  graph.file = fs::absolute(graph.file).lexically_normal().string();
  for (NodeSpec& node : graph.nodes) {
    if (!node.params.empty()) node.params = fs::absolute(node.params).lexically_normal().string();
  }
  return Export(graph, run).units();
}

std::vector<std::string> write_units(const std::string& folder, const std::string& graph,
                                     const BootUnits& units) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  std::vector<std::string> removed;
  const std::string slice = slice_name(graph), stem = slice.substr(0, slice.rfind('.'));
  std::set<fs::path> stale;
  for (fs::directory_iterator it(folder, failed), end; !failed && it != end; it.increment(failed)) {
    const std::string file = it->path().filename();
    const bool of_graph =
        file.starts_with(stem + "-") || file == stem + ".target" || file == stem + ".end.target";
    if (of_graph && !units.files.contains(file) && content(it->path()).starts_with(kHeader))
      stale.insert(it->path());
  }
  for (const fs::path& file : stale) {
    if (fs::remove(file, failed)) removed.push_back(file.filename());
  }
  for (const auto& [file, text] : units.files) {
    std::ofstream out(fs::path(folder) / file);
    if (!(out << text).flush())
      throw ConfigError((fs::path(folder) / file).string() + ": cannot be written");
  }
  return removed;
}

}  // namespace mimesis::launch
