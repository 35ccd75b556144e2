// The real launcher with engine systemd, beside a real systemd (with_systemd), as root.
#include <gtest/gtest.h>
#include <signal.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "common/machine_time.h"
#include "common/testing/process.h"
#include "tools/mimesis/launch/command.h"
#include "tools/mimesis/launch/test/graph_text.h"

namespace mimesis::launch {
namespace {
using namespace std::chrono_literals;
using nlohmann::json;
using testing::Process;

std::string told(const std::string& program, const std::vector<std::string>& arguments) {
  Process p("/usr/bin/" + program, arguments);
  p.wait();
  std::string text = p.output();
  while (text.ends_with('\n')) text.pop_back();
  return text;
}

class LaunchSystemd : public ::testing::Test {
 protected:
  LaunchSystemd() { setenv("XDG_STATE_HOME", folder_.path().c_str(), 1); }
  void TearDown() override {
    EXPECT_TRUE(until([&] { return units().empty(); })) << units();
  }

  void start(const std::string& nodes) {
    launch_ = std::make_unique<Process>(
        "mimesis",
        std::vector<std::string>{
            "launch",
            folder_.write("g.yaml",
                          "version: 1\nhosts: {here: {address: localhost, engine: systemd}}\n"
                          "defaults: {host: here}\nnodes:\n" +
                              nodes),
            "--graph", graph_.name(), "--name", "run", "--json", "-v"});
  }
  static bool until(const std::function<bool()>& done, std::chrono::milliseconds most = 10s) {
    MachineTime time;
    while (!done()) {
      if (time.passed() > most) return false;
      std::this_thread::sleep_for(20ms);
    }
    return true;
  }
  /// Services of launchers that are loaded: nodes and leases.
  static std::string units() {
    return told("systemctl",
                {"list-units", "--all", "--plain", "--no-legend", "--type=service", "mimesis*"});
  }
  std::string unit(const std::string& node) const { return unit_name(graph_.name(), node); }
  std::string of(const std::string& node, const std::string& property) const {
    return told("systemctl", {"show", "-P", property, unit(node)});
  }
  bool ready(const std::string& node) {
    return until([&] { return launch_->errors().find(node + " is ready") != std::string::npos; });
  }
  json summary() const {
    return json::parse(launch_->output().substr(0, launch_->output().find('\n')));
  }
  /// A foreign program that appends its name to `order` when it is asked to stop.
  std::string notes(const std::string& name, const std::string& more) const {
    return "  " + name + ": {exec: sh, ready: started, " + more + "args: [-c, \"trap 'echo " +
           name + " >> " + folder_.path() + "/order; exit 0' INT; echo " + name + " >> " +
           folder_.path() + "/up; sleep 1000 & wait\"]}\n";
  }
  bool written(const std::string& file, const std::string& text) {
    return until([&] { return folder_.read(file).find(text) != std::string::npos; });
  }

  const std::string counter_ = MIMESIS_COUNTER;
  TemporaryFolder folder_;
  testing::TestGraph graph_;
  std::unique_ptr<Process> launch_;
};

TEST_F(LaunchSystemd, NodesAreUnitsThatSystemdKnowsToBeReadyAndTheirOutputIsShown) {
  start("  a: {exec: " + counter_ + ", required: true}\n  b: {exec: " + counter_ +
        ", after: [a], sched: {policy: fifo, priority: 20, cpus: [0], mlock: true}}\n");
  ASSERT_TRUE(ready("b")) << launch_->errors();
  ASSERT_TRUE(until([&] { return of("b", "ActiveState") == "active"; })) << of("b", "ActiveState");
  EXPECT_EQ(of("b", "Type"), "notify");
  EXPECT_EQ(of("b", "Slice"), slice_name(graph_.name()));
  EXPECT_EQ(of("b", "WatchdogUSec"), "0");    // neither required nor started again
  EXPECT_EQ(of("a", "WatchdogUSec"), "10s");  // 5 times hung_after
  EXPECT_EQ(of("a", "KillSignal"), "2");
  EXPECT_EQ(of("a", "KillMode"), "mixed");
  const std::string schedule = told("chrt", {"-p", of("b", "MainPID")});
  EXPECT_NE(schedule.find("SCHED_FIFO"), std::string::npos) << schedule;
  EXPECT_NE(schedule.find("priority: 20"), std::string::npos) << schedule;
  EXPECT_NE(told("taskset", {"-p", of("b", "MainPID")}).find("mask: 1"), std::string::npos);
  EXPECT_TRUE(until([&] { return of("a", "StatusText").find(" overruns") != std::string::npos; }));
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130);
  EXPECT_NE(launch_->errors().find("[b] "), std::string::npos);
  EXPECT_NE(folder_.read("mimesis/log/run/a.log").find("stopped after"), std::string::npos);
  const auto report = summary();
  for (const auto& node : report["nodes"]) {
    EXPECT_EQ(node["exit_code"], 0) << node;
    EXPECT_EQ(node["killed"], false) << node;
  }
}

TEST_F(LaunchSystemd, StopsInReverseWithActuatorsLast) {
  start(notes("bridge", "stop: {order: last}, after: [drives], ") + notes("drives", "") +
        notes("planner", "after: [bridge], ") + notes("world", ""));
  ASSERT_TRUE(written("up", "planner") && written("up", "world")) << launch_->errors();
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130);
  EXPECT_EQ(folder_.read("order"), "planner\nworld\nbridge\ndrives\n") << launch_->errors();
}

TEST_F(LaunchSystemd, ExitCodesSignalsAndRestartsAreThoseOfProcesses) {
  start("  a: {exec: " + counter_ +
        ", restart: {delay: 1ms}}\n"
        "  b: {exec: sh, ready: started, after: [a], required: true, args: [-c, \"until [ -e " +
        folder_.path() + "/go ]; do sleep 0.02; done; exit 7\"]}\n");
  ASSERT_TRUE(ready("a")) << launch_->errors();
  const std::string first = of("a", "MainPID");
  kill(std::stoi(first), SIGKILL);
  EXPECT_TRUE(until([&] {
    return of("a", "MainPID") != first && of("a", "SubState") == "running";
  })) << launch_->errors();
  folder_.write("go", "");
  EXPECT_EQ(launch_->wait(), 7);
  EXPECT_NE(launch_->errors().find("a was killed by SIGKILL; starting it again"),
            std::string::npos);
  const json report = summary();
  EXPECT_EQ(report["reason"], "node 'b' ended with exit code 7");
  EXPECT_EQ(report["nodes"][0]["restarts"], 1);
}

TEST_F(LaunchSystemd, AHungRequiredNodeEndsTheRunAndIsKilled) {
  start("  a: {exec: " + counter_ +
        ", required: true, hung_after: 1s, stop: {timeout: 200ms}}\n  b: {exec: " + counter_ +
        "}\n");
  ASSERT_TRUE(ready("a") && ready("b")) << launch_->errors();
  kill(std::stoi(of("a", "MainPID")), SIGSTOP);
  EXPECT_EQ(launch_->wait(), 1);
  EXPECT_EQ(summary()["reason"].get<std::string>().find("node 'a' hung for "), 0U) << summary();
  EXPECT_EQ(summary()["nodes"][0]["exit_code"], 137);
}

// The second line: nobody supervises, and systemd's own watchdog ends the node.
TEST_F(LaunchSystemd, SystemdSeesAHungNodeItself) {
  start("  a: {exec: " + counter_ + ", restart: on-failure, hung_after: 100ms}\n");
  ASSERT_TRUE(ready("a") && until([&] { return of("a", "ActiveState") == "active"; }));
  EXPECT_EQ(of("a", "WatchdogUSec"), "500ms");
  const std::string pid = of("a", "MainPID");
  std::ifstream children("/proc/" + std::to_string(launch_->pid()) + "/task/" +
                         std::to_string(launch_->pid()) + "/children");
  pid_t supervisor = 0;
  ASSERT_TRUE(children >> supervisor);
  kill(launch_->pid(), SIGSTOP);  // the subreaper, which would end a launcher that hangs
  kill(supervisor, SIGSTOP);
  kill(std::stoi(pid), SIGSTOP);
  EXPECT_TRUE(until([&] { return of("a", "Result") == "watchdog"; })) << of("a", "Result");
  kill(supervisor, SIGCONT);
  kill(launch_->pid(), SIGCONT);
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130);
}

TEST_F(LaunchSystemd, SystemdEndsTheNodesOfAKilledLauncher) {
  for (const bool subreaper : {true, false}) {
    start("  a: {exec: " + counter_ + "}\n" + notes(subreaper ? "x" : "y", ""));
    ASSERT_TRUE(ready("a") && written("up", subreaper ? "x" : "y")) << launch_->errors();
    std::ifstream children("/proc/" + std::to_string(launch_->pid()) + "/task/" +
                           std::to_string(launch_->pid()) + "/children");
    pid_t supervisor = 0;
    ASSERT_TRUE(children >> supervisor);
    kill(subreaper ? launch_->pid() : supervisor, SIGKILL);
    EXPECT_EQ(launch_->wait(), subreaper ? 137 : 1);
    EXPECT_TRUE(until([&] { return units().empty(); })) << units();
    // Each was asked once, by its own signal.
    EXPECT_EQ(folder_.read("order"), subreaper ? "x\n" : "x\ny\n");
  }
}

// Others than root have a manager of their own.
TEST_F(LaunchSystemd, TheManagerOfAUserStartsUnitsAndStopsThoseOfAKilledLauncher) {
  ASSERT_EQ(told("systemctl", {"start", "user-manager"}), "");
  const std::string home = "/run/user/65534";
  const auto as_user = [&](std::vector<std::string> words) {
    const std::string folders = "XDG_STATE_HOME=" + home + "/state";
    const std::vector<std::string> user{
        "--reuid=65534", "--clear-groups",          "env",  "-C", home, "-u",
        "TMPDIR",        "XDG_RUNTIME_DIR=" + home, folders};
    words.insert(words.begin(), user.begin(), user.end());
    return std::make_unique<Process>("/usr/bin/setpriv", words);
  };
  const auto state = [&](const std::string& property) {
    const auto asked = as_user({"systemctl", "--user", "show", "-P", property, unit("a")});
    asked->wait();
    return asked->output();
  };
  std::ofstream(home + "/g.yaml") << "version: 1\nhosts: {here: {address: localhost, engine: "
                                     "systemd}}\ndefaults: {host: here}\nnodes:\n  a: {exec: "
                                  << counter_ << ", restart: {delay: 1ms}}\n";
  for (const bool killed : {false, true}) {
    launch_ = as_user({MIMESIS_BIN_DIR "/mimesis", "launch", home + "/g.yaml", "--graph",
                       graph_.name(), "--json"});
    ASSERT_TRUE(ready("a")) << launch_->errors();
    ASSERT_TRUE(until([&] { return state("SubState") == "running\n"; })) << state("SubState");
    EXPECT_EQ(state("Slice"), slice_name(graph_.name()) + "\n");
    const std::string pid = state("MainPID");
    kill(std::stoi(pid), SIGKILL);
    EXPECT_TRUE(until([&] { return state("MainPID") != pid && state("SubState") == "running\n"; }));
    EXPECT_TRUE(until([&] {
      return told("journalctl", {"-q", "-o", "cat", "OBJECT_SYSTEMD_USER_UNIT=" + unit("a")})
                 .find("ready") != std::string::npos;
    }));
    launch_->signal(killed ? SIGKILL : SIGINT);
    EXPECT_EQ(launch_->wait(), killed ? 137 : 130) << launch_->errors();
    EXPECT_TRUE(until([&] { return state("SubState") == "dead\n"; })) << state("SubState");
  }
  EXPECT_EQ(told("systemctl", {"stop", "--no-block", "user-manager"}), "");
}

TEST_F(LaunchSystemd, ChildrenOfANodeThatIsKilledDieWithIt) {
  start(
      "  a: {exec: sh, ready: started, stop: {timeout: 100ms}, args: [-c, \"trap '' INT; setsid "
      "sleep 1234 & echo up > " +
      folder_.path() + "/up; while :; do wait; sleep 1; done\"]}\n");
  ASSERT_TRUE(written("up", "up")) << launch_->errors();
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130);
  EXPECT_EQ(summary()["nodes"][0]["killed"], true);
  EXPECT_TRUE(until([] { return told("pgrep", {"-fx", "sleep 1234"}).empty(); }));
}

// A robot boots with exported units; the user and folders of an installed Mimesis are not here.
TEST_F(LaunchSystemd, ExportedUnitsStartAndStopInOrderAndEndWithARequiredNode) {
  const std::string file = folder_.write(
      "g.yaml", "version: 1\nnodes:\n" + notes("bridge", "stop: {order: last}, after: [c], ") +
                    "  c: {exec: " + counter_ + ", required: true, restart: on-failure}\n" +
                    notes("world", "") +
                    "  end: {exec: sh, ready: started, required: true, after: [world], args: [-c, "
                    "\"until [ -e " +
                    folder_.path() + "/go ]; do sleep 0.02; done; exit 3\"]}\n");
  Process exporter("mimesis", {"launch", "export", file, "--graph", graph_.name(), "--systemd",
                               folder_.path() + "/units"});
  ASSERT_EQ(exporter.wait(), 0) << exporter.errors();
  for (const auto& unit : std::filesystem::directory_iterator(folder_.path() + "/units")) {
    std::ifstream in(unit.path());
    std::ofstream out("/run/units/" + unit.path().filename().string());
    for (std::string line; std::getline(in, line);) {
      const bool installed = line.starts_with("User=") || line.starts_with("StateDirectory=");
      if (line == "Environment=XDG_RUNTIME_DIR=/run")
        line = "Environment=XDG_RUNTIME_DIR=" + std::string(std::getenv("XDG_RUNTIME_DIR"));
      if (!installed) out << line << "\n";
    }
  }
  const std::string slice = slice_name(graph_.name());
  const std::string target = slice.substr(0, slice.rfind('.')) + ".target";
  const auto stopped = [&] {
    for (const char* node : {"bridge", "c", "world", "end"}) {
      const std::string state = of(node, "ActiveState");
      if (state == "active" || state == "deactivating" || state == "activating") return false;
    }
    return true;
  };
  told("systemctl", {"daemon-reload"});
  for (const bool by_end : {false, true}) {
    std::filesystem::remove(folder_.path() + "/up");
    std::filesystem::remove(folder_.path() + "/order");
    EXPECT_EQ(told("systemctl", {"start", target}), "");
    EXPECT_EQ(of("c", "ActiveState"), "active");  // Type=notify: it is ready
    EXPECT_EQ(of("end", "ActiveState"), "active");
    ASSERT_TRUE(written("up", "world") && written("up", "bridge"));
    const std::string pid = of("c", "MainPID");
    kill(std::stoi(pid), SIGKILL);
    EXPECT_TRUE(
        until([&] { return of("c", "MainPID") != pid && of("c", "SubState") == "running"; }));
    if (by_end) {
      folder_.write("go", "");
    } else {
      told("systemctl", {"stop", target});
    }
    EXPECT_TRUE(until(stopped));
    EXPECT_EQ(folder_.read("order"), "world\nbridge\n");
  }
  EXPECT_EQ(of("end", "ExecMainStatus"), "3");
  for (const auto& unit : std::filesystem::directory_iterator(folder_.path() + "/units"))
    std::filesystem::remove("/run/units/" + unit.path().filename().string());
  told("systemctl", {"reset-failed"});
  told("systemctl", {"daemon-reload"});
}

TEST_F(LaunchSystemd, WhatCannotBeStartedEndsTheRun) {
  const std::string none = folder_.write("none", "#!/there/is/no/shell\n");
  std::filesystem::permissions(none, std::filesystem::perms::all);
  start("  a: {exec: " + none + ", ready: started}\n");
  EXPECT_EQ(launch_->wait(), 1);
  EXPECT_EQ(summary()["reason"], "node 'a' cannot be started: it cannot be executed");
}

}  // namespace
}  // namespace mimesis::launch
