#pragma once
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "common/machine_time.h"
#include "common/testing/process.h"
#include "tools/mimesis/launch/test/graph_text.h"

namespace mimesis::launch {

using namespace std::chrono_literals;
using nlohmann::json;

/// The real launcher with real nodes (mimesis_counter) and shell scripts.
class Launch : public ::testing::Test {
 protected:
  Launch() { setenv("XDG_STATE_HOME", folder_.path().c_str(), 1); }

  std::unique_ptr<testing::Process> start(const std::string& text,
                                          std::vector<std::string> options = {}) {
    options.insert(options.begin(), {"launch", folder_.write("g.yaml", "version: 1\n" + text),
                                     "--graph", graph_.name(), "--name", "run", "--json"});
    return std::make_unique<testing::Process>("mimesis", options);
  }

  /// Waits for a change of the node list until `done`; false after 10 s.
  bool until(const std::function<bool()>& done) {
    runtime::GraphView view(graph_.name());
    MachineTime time;
    while (!done()) {
      if (time.passed() > 10s) return false;
      view.wait(10ms);
    }
    return true;
  }
  bool until_written(const std::string& file, const std::string& text) {
    return until([&] { return folder_.read(file).find(text) != std::string::npos; });
  }
  std::map<std::string, pid_t> pids() const {
    std::map<std::string, pid_t> all;
    for (const v1::NodeInfo& node : runtime::GraphView(graph_.name()).nodes()) {
      if (node.ready()) all[node.name()] = static_cast<pid_t>(node.pid());
    }
    return all;
  }
  static bool alive(pid_t pid) { return kill(pid, 0) == 0; }
  /// The process that supervises a node.
  static pid_t parent(pid_t pid) {
    std::ifstream in("/proc/" + std::to_string(pid) + "/stat");
    const std::string stat{std::istreambuf_iterator<char>(in), {}};
    return std::stoi(stat.substr(stat.rfind(')') + 4));
  }
  /// Files in the folder of the graph.
  std::vector<std::string> left_in_graph() const {
    std::vector<std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(graph_.directory())) {
      if (!entry.is_directory()) files.push_back(entry.path().filename());
    }
    std::ranges::sort(files);
    return files;
  }
  /// A recorder, and a program that ends well once the file `go` is there.
  std::string recorded(const std::string& options) const {
    return "nodes:\n  a: {exec: " + counter_ +
           "}\n  r: {exec: mimesis, args: [log, record, --all, -o, " + folder_.path() + "/x.mcap" +
           options +
           "]}\n  end: {exec: sh, ready: started, required: true, args: " + "[-c, \"until [ -e " +
           folder_.path() + "/go ]; do sleep 0.02; done\"]}\n";
  }
  /// The counter under a name that is no node's: a plain launch does not ask it what it is.
  std::string undescribed() const {
    const std::string link = folder_.path() + "/plain";
    if (!std::filesystem::exists(link)) std::filesystem::create_symlink(counter_, link);
    return link;
  }
  /// What --check prints.
  static json mistakes(const testing::Process& p) { return json::parse(p.output()); }
  static json summary(const testing::Process& p) {
    return json::parse(p.output().substr(0, p.output().find('\n')));
  }
  static json last_line(const testing::Process& p) {
    std::string out = p.output();
    out.pop_back();
    return json::parse(out.substr(out.rfind('\n') + 1));
  }
  /// A foreign program that appends its name to `order` when it is asked to stop.
  std::string stops_with_a_note(const std::string& name, const std::string& more) const {
    return "  " + name + ": {exec: sh, ready: started, " + more + "args: [-c, \"trap 'echo " +
           name + " >> " + folder_.path() + "/order; exit 0' INT; echo " + name + " >> " +
           folder_.path() + "/up; sleep 1000 & wait\"]}\n";
  }

  const std::string counter_ = MIMESIS_COUNTER;
  TemporaryFolder folder_;
  testing::TestGraph graph_;
};

}  // namespace mimesis::launch
