// The real launcher with real nodes (mimesis_counter) and shell scripts.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <thread>

#include "common/testing/process.h"
#include "tools/mimesis/launch/test/graph_text.h"

namespace mimesis::launch {
namespace {
using namespace std::chrono_literals;
using nlohmann::json;

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
    const auto deadline = std::chrono::steady_clock::now() + 10s;
    while (!done()) {
      if (std::chrono::steady_clock::now() > deadline) return false;
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
  /// Of a node: the process that supervises.
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

TEST_F(Launch, StartsWhenThoseBeforeAreReadyAndStopsInReverse) {
  auto launch = start("nodes:\n  c: {exec: " + counter_ + ", after: [b]}\n  b: {exec: " + counter_ +
                          ", after: [a]}\n  a: {exec: " + counter_ + "}\n",
                      {"--verbose"});
  ASSERT_TRUE(until([&] { return pids().size() == 3; })) << launch->errors();
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
  const std::string err = launch->errors();
  const std::size_t positions[] = {err.find("a is ready"), err.find("[b] "), err.find("b is ready"),
                                   err.find("[c] ")};
  EXPECT_TRUE(std::is_sorted(std::begin(positions), std::end(positions))) << err;
  EXPECT_NE(positions[3], std::string::npos);
  const auto report = summary(*launch);  // outlives the loop over a part of it
  for (const auto& node : report["nodes"]) EXPECT_EQ(node["exit_code"], 0) << node;
  EXPECT_NE(folder_.read("mimesis/log/run/a.log").find("ready"), std::string::npos);
}

TEST_F(Launch, StopsActuatorsLast) {
  auto launch =
      start("nodes:\n" + stops_with_a_note("bridge", "stop: {order: last}, after: [drives], ") +
            stops_with_a_note("drives", "") + stops_with_a_note("planner", "after: [bridge], ") +
            stops_with_a_note("world", ""));
  ASSERT_TRUE(until_written("up", "planner"));
  ASSERT_TRUE(until_written("up", "world"));
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
  EXPECT_EQ(folder_.read("order"), "planner\nworld\nbridge\ndrives\n") << launch->errors();
}

TEST_F(Launch, EndsWithTheCodeOfTheRequiredNode) {
  auto launch =
      start("nodes:\n  a: {exec: " + counter_ +
            "}\n  b: {exec: sh, ready: started, args: [-c, exit 7], required: true, after: [a]}\n");
  EXPECT_EQ(launch->wait(), 7);
  EXPECT_EQ(summary(*launch)["reason"], "node 'b' ended with exit code 7");
  EXPECT_TRUE(pids().empty());
}

TEST_F(Launch, ShowsSoManyLinesASecondAndKeepsAll) {
  auto launch = start("nodes:\n  a: {exec: seq, ready: started, args: ['100000']}\n");
  EXPECT_EQ(launch->wait(), 0);
  const std::string err = launch->errors(), log = folder_.read("mimesis/log/run/a.log");
  EXPECT_LT(std::ranges::count(err, '\n'), 20'000) << "500 a second";
  EXPECT_NE(err.find(" lines more: see its .log)\n"), std::string::npos);
  EXPECT_EQ(std::ranges::count(log, '\n'), 100'000);
}

TEST_F(Launch, FailsIfNoNodeIsLeftAndOneFailed) {
  auto launch = start(
      "nodes:\n  a: {exec: sh, ready: started, args: [-c, exit 0]}\n"
      "  b: {exec: sh, ready: started, args: [-c, kill -9 $$]}\n");
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_EQ(summary(*launch)["reason"], "no node is left, and node 'b' was killed by SIGKILL");
}

TEST_F(Launch, TellsWhatARequiredNodeSaidThatCouldNotBegin) {
  auto launch = start("nodes:\n  a: {exec: " + counter_ +
                      "}\n  b: {exec: sh, args: [-c, 'echo one >&2; echo two >&2; echo out; "
                      "echo \"[09:00:00.000] [b] info: ready\" >&2; exit 2'], required: true}\n");
  EXPECT_EQ(launch->wait(), 2);
  EXPECT_EQ(summary(*launch)["reason"], "node 'b' ended with exit code 2: two");
}

TEST_F(Launch, AReasonMayHoldAnyBytes) {
  auto launch = start(
      "nodes:\n  b: {exec: sh, args: [-c, 'printf \"a\\377\" >&2; exit 2'], required: true}\n");
  EXPECT_EQ(launch->wait(), 2);
  EXPECT_EQ(summary(*launch)["reason"], "node 'b' ended with exit code 2: a\uFFFD");
}

TEST_F(Launch, NamesTheSignalThatKilledTheRequiredNode) {
  auto launch = start("nodes:\n  a: {exec: " + counter_ + ", required: true}\n");
  ASSERT_TRUE(until([&] { return pids().size() == 1; }));
  kill(pids().at("a"), SIGSEGV);
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_EQ(summary(*launch)["reason"], "node 'a' was killed by SIGSEGV");
}

TEST_F(Launch, GoesOnWithoutANodeThatIsNotRequired) {
  auto launch = start("nodes:\n  a: {exec: " + counter_ +
                      "}\n  b: {exec: sh, ready: started, args: [-c, exit 7]}\n");
  ASSERT_TRUE(until([&] {
    return pids().size() == 1 &&
           launch->errors().find("node 'b' ended with exit code 7") != std::string::npos;
  }));
  launch->signal(SIGTERM);
  EXPECT_EQ(launch->wait(), 143);
}

TEST_F(Launch, NamesTheNodeThatDoesNotBecomeReady) {
  auto launch = start(
      "nodes:\n  mute: {exec: mimesis, args: [topic, hz, nothing], ready: {within: 200ms}, "
      "required: true}\n");
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_EQ(summary(*launch)["reason"], "node 'mute' was not ready within 0.2 s");
}

TEST_F(Launch, PassesOnTheCodeOfBadParameters) {
  auto launch = start("nodes:\n  a:\n    exec: " + undescribed() +
                      "\n    required: true\n    params: {rate_hz: 0}\n");
  EXPECT_EQ(launch->wait(), 2);
  EXPECT_NE(launch->errors().find("g.yaml:6:23: counter.rate_hz: 0 is outside"), std::string::npos)
      << launch->errors();
}

TEST_F(Launch, RestartsWithBackOffAndThenGivesUp) {
  auto launch = start(
      "nodes:\n  a: {exec: sh, ready: started, args: [-c, exit 4], required: true, "
      "restart: {delay: 10ms, backoff: 2, max: 3}}\n");
  EXPECT_EQ(launch->wait(), 4);
  EXPECT_EQ(summary(*launch)["nodes"][0]["restarts"], 3);
  for (const char* delay : {"again in 0.01 s", "again in 0.02 s", "again in 0.04 s"}) {
    EXPECT_NE(launch->errors().find(delay), std::string::npos) << launch->errors();
  }
}

TEST_F(Launch, RestartedNodeComesBack) {
  auto launch = start("nodes:\n  a: {exec: " + counter_ + ", restart: {delay: 1ms}}\n");
  const auto pid = [&] {  // in one look: between two of them it may come or go
    const auto all = pids();
    return all.contains("a") ? static_cast<pid_t>(all.at("a")) : 0;
  };
  pid_t first = 0;
  ASSERT_TRUE(until([&] { return (first = pid()) != 0; }));
  kill(first, SIGKILL);
  EXPECT_TRUE(until([&] {
    const pid_t now = pid();
    return now != 0 && now != first;
  })) << launch->errors();
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
}

TEST_F(Launch, NamesAHungNodeAndEndsTheRunIfItIsRequired) {
  const auto start_two = [&](const std::string& more) {
    auto launch = start("nodes:\n  a: {exec: " + counter_ + "}\n  b: {exec: " + counter_ + more +
                        ", after: [a], stop: {timeout: 100ms}}\n");
    EXPECT_TRUE(until([&] { return pids().size() == 2; })) << launch->errors();
    return launch;
  };
  const auto said = [&](const testing::Process& launch, const std::string& text) {
    return until([&] { return launch.errors().find(text) != std::string::npos; });
  };
  auto launch = start_two(", required: true");
  auto stopped = std::chrono::steady_clock::now();
  kill(pids().at("b"), SIGSTOP);
  ASSERT_TRUE(said(*launch, "b hangs: no sign of life for ")) << launch->errors();
  EXPECT_LT(std::chrono::steady_clock::now() - stopped, 1500ms);
  EXPECT_GT(std::chrono::steady_clock::now() - stopped, 500ms);
  EXPECT_EQ(launch->wait(), 1);
  const std::string line = launch->errors().substr(launch->errors().find("b hangs") + 1);
  EXPECT_EQ(line.find("b hangs"), std::string::npos) << "said once: " << launch->errors();
  EXPECT_TRUE(std::string(summary(*launch)["reason"]).starts_with("node 'b' hung for 2."))
      << summary(*launch);
  EXPECT_NE(launch->errors().find("(stopped by a signal)"), std::string::npos);

  launch = start_two("");
  kill(pids().at("b"), SIGSTOP);
  ASSERT_TRUE(said(*launch, "b hangs")) << launch->errors();
  kill(pids().at("b"), SIGCONT);
  EXPECT_TRUE(said(*launch, "b goes on after ")) << launch->errors();
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);

  launch = start_two(", params: {hang_at_step: 50}, hung_after: 1s, restart: on-failure");
  EXPECT_TRUE(said(*launch, "(it waits)")) << launch->errors();
  EXPECT_TRUE(said(*launch, "b was killed by SIGKILL; starting it again")) << launch->errors();
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
}

TEST_F(Launch, TimeInWhichItStoodItselfIsNobodysSilence) {
  auto launch =
      start("nodes:\n  a: {exec: " + counter_ + ", required: true}\n  b: {exec: " + counter_ +
            ", required: true, hung_after: 0s, stop: {timeout: 100ms}}\n");
  ASSERT_TRUE(until([&] { return pids().size() == 2; })) << launch->errors();
  const pid_t a = pids().at("a"), b = pids().at("b"), supervisor = parent(a);
  const auto pause = [](std::chrono::milliseconds time) { std::this_thread::sleep_for(time); };
  pause(300ms);  // a sign of life has come
  kill(supervisor, SIGSTOP);
  kill(a, SIGSTOP);
  pause(1500ms);
  kill(supervisor, SIGCONT);
  pause(100ms);
  kill(a, SIGCONT);
  kill(b, SIGSTOP);
  EXPECT_TRUE(until([&] { return launch->errors().find("b hangs") != std::string::npos; }));
  pause(2s);  // it is required, but may hang for ever
  EXPECT_EQ(launch->errors().find("a hangs"), std::string::npos) << launch->errors();
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130) << launch->errors();
}

TEST_F(Launch, AHungLauncherIsNamedAndEnded) {
  const auto start_one = [&] {
    auto launch = start("nodes:\n  a: {exec: " + counter_ + "}\n");
    EXPECT_TRUE(until([&] { return pids().size() == 1; })) << launch->errors();
    std::this_thread::sleep_for(300ms);  // a sign of life has come
    kill(parent(pids().at("a")), SIGSTOP);
    EXPECT_TRUE(until([&] {
      return launch->errors().find("the launcher hangs: no sign of life") != std::string::npos;
    })) << launch->errors();
    return launch;
  };
  auto launch = start_one();
  const pid_t a = pids().at("a");
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_TRUE(std::string(summary(*launch)["reason"]).starts_with("the launcher hung for 2."))
      << summary(*launch);
  EXPECT_NE(launch->errors().find("(stopped by a signal)"), std::string::npos);
  EXPECT_FALSE(alive(a));

  launch = start_one();
  kill(parent(pids().at("a")), SIGCONT);
  EXPECT_TRUE(until([&] {
    return launch->errors().find("the launcher goes on after ") != std::string::npos;
  })) << launch->errors();
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
}

TEST_F(Launch, ALauncherThatWaitsForItsReaderDoesNotHang) {
  const std::string file = folder_.write("g.yaml",
                                         "version: 1\nnodes:\n  loud: {exec: sh, ready: started, "
                                         "required: true, args: [-c, \"sleep 1; yes | "
                                         "head -c 300000 >&2; sleep 1\"]}\n");
  const auto bin = std::filesystem::read_symlink("/proc/self/exe").parent_path() / "../bin";
  testing::Process shell(
      "/bin/sh", {"-c", (bin / "mimesis launch ").string() + file + " --graph " + graph_.name() +
                            " 2>&1 | (sleep 4; exec tail -n 3)"});
  EXPECT_EQ(shell.wait(), 0);
  EXPECT_EQ(shell.output().find("the launcher"), std::string::npos) << shell.output();
  EXPECT_NE(shell.output().find("logs in"), std::string::npos) << shell.output();
}

TEST_F(Launch, AStoppedRecorderDoesNotKeepOthersFromStopping) {
  auto launch = start("clock: lockstep\nnodes:\n  a: {exec: " + counter_ +
                      ", params: {rate_hz: 1000}}\n  r: {exec: mimesis, args: [log, record, --all, "
                      "-o, " +
                      folder_.path() + "/x.mcap]}\n");
  ASSERT_TRUE(until([&] { return pids().size() == 3; })) << launch->errors();
  for (const auto& [name, pid] : pids()) {
    if (name != "a" && name != "clock") kill(pid, SIGSTOP);
  }
  std::this_thread::sleep_for(500ms);  // its queues are full
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130) << launch->errors();
  const json nodes = summary(*launch)["nodes"];
  ASSERT_EQ(nodes.size(), 3U);
  for (const json& node : nodes) EXPECT_EQ(node["killed"], node["name"] == "r") << node;
}

TEST_F(Launch, AHungNodeEndsARunInLockstep) {
  auto launch = start("clock: lockstep\nnodes:\n  a: {exec: " + counter_ +
                      ", required: true}\n  b: {exec: " + counter_ + "}\n");
  ASSERT_TRUE(until([&] { return pids().size() == 3; })) << launch->errors();
  kill(pids().at("a"), SIGSTOP);
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_TRUE(std::string(summary(*launch)["reason"]).starts_with("node 'a' hung for 2."));
  EXPECT_EQ(launch->errors().find("b hangs"), std::string::npos) << launch->errors();
}

TEST_F(Launch, RealTimePriorityIsGrantedOrTheRunRefused) {
  if (geteuid() != 0) GTEST_SKIP() << "needs root";
  const std::string nodes =
      "nodes:\n  a: {exec: " + counter_ + ", sched: {policy: fifo, priority: 10, mlock: true}}\n";
  auto launch = start(nodes);
  ASSERT_TRUE(until([&] { return pids().size() == 1; })) << launch->errors();
  EXPECT_EQ(sched_getscheduler(pids()["a"]), SCHED_FIFO);
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
  testing::Process without("/usr/bin/setpriv",
                           {"--bounding-set=-sys_nice", "/usr/bin/prlimit", "--rtprio=0",
                            MIMESIS_BIN_DIR "/mimesis", "launch", folder_.path() + "/g.yaml",
                            "--graph", graph_.name(), "--name", "other", "--json"});
  EXPECT_EQ(without.wait(), 1);
  EXPECT_EQ(summary(without)["reason"],
            "node 'a' cannot be started: " + counter_ + ": sched.policy: Operation not permitted");
  EXPECT_TRUE(pids().empty());
}

TEST_F(Launch, KillsWhatDoesNotStop) {
  auto launch = start(
      "nodes:\n  deaf: {exec: sh, ready: started, stop: {timeout: 100ms}, args: [-c, \"trap '' INT "
      "TERM; echo $$ > " +
      folder_.path() + "/pid; sleep 1000 & wait\"]}\n");
  ASSERT_TRUE(until_written("pid", "\n"));
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
  EXPECT_EQ(summary(*launch)["nodes"][0]["killed"], true);
  EXPECT_FALSE(alive(std::stoi(folder_.read("pid"))));
}

TEST_F(Launch, ARequiredNodeThatHadToBeKilledIsAFailure) {
  auto launch = start(
      "nodes:\n  a: {exec: " + counter_ +
      "}\n  deaf: {exec: sh, ready: started, required: true, stop: {timeout: 100ms}, args: [-c, "
      "\"trap '' INT TERM; sleep 1000 & wait\"]}\n"
      "result: {until: a/out, fields: {n: a/out.seq}}\n");
  EXPECT_EQ(launch->wait(), 1) << launch->errors();
  EXPECT_EQ(last_line(*launch)["reason"], "node 'deaf' did not stop in time");
  EXPECT_EQ(last_line(*launch)["success"], false);
}

TEST_F(Launch, SecondInterruptHastens) {
  auto launch = start(
      "nodes:\n  deaf: {exec: sh, ready: started, stop: {timeout: 1h}, args: [-c, \"trap '' INT; "
      "echo up > " +
      folder_.path() + "/up; sleep 1000 & wait\"]}\n");
  ASSERT_TRUE(until_written("up", "up"));
  launch->signal(SIGINT);
  ASSERT_TRUE(until([&] { return launch->errors().find("interrupted") != std::string::npos; }));
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
}

/// A node, a script that ignores all signals that can be ignored, and its child in a session of its
/// own.
class NoOrphan : public Launch {
 protected:
  void SetUp() override {
    launch_ = start("nodes:\n  a: {exec: " + counter_ +
                    "}\n  deaf: {exec: sh, ready: started, stop: {timeout: 100ms}, args: [-c, "
                    "\"trap '' INT TERM "
                    "HUP; setsid sh -c 'echo $$ > " +
                    folder_.path() + "/grandchild; exec sleep 1000' & echo $$ > " + folder_.path() +
                    "/child; wait\"]}\n");
    ASSERT_TRUE(until([&] { return pids().size() == 1; }));
    ASSERT_TRUE(until_written("child", "\n"));
    ASSERT_TRUE(until_written("grandchild", "\n"));
    all_ = {pids().at("a"), std::stoi(folder_.read("child")),
            std::stoi(folder_.read("grandchild"))};
    worker_ = parent(all_[0]);
    ASSERT_NE(worker_, launch_->pid());
  }
  bool all_gone() {
    return until([&] { return std::none_of(all_.begin(), all_.end(), alive); });
  }

  std::unique_ptr<testing::Process> launch_;
  std::vector<pid_t> all_;
  pid_t worker_ = 0;
};

TEST_F(NoOrphan, AfterKillOfTheLauncher) {
  launch_->signal(SIGKILL);
  EXPECT_EQ(launch_->wait(), 128 + SIGKILL);
  EXPECT_TRUE(all_gone());
}

TEST_F(NoOrphan, AfterKillOfItsSupervisor) {
  kill(worker_, SIGKILL);
  EXPECT_EQ(launch_->wait(), 1);
  EXPECT_TRUE(all_gone());
  EXPECT_NE(launch_->errors().find("the launcher was killed by SIGKILL"), std::string::npos);
  EXPECT_EQ(summary(*launch_)["exit_code"], 1);
  EXPECT_EQ(summary(*launch_)["reason"], "the launcher was killed by SIGKILL");
  EXPECT_EQ(left_in_graph(), std::vector<std::string>{});
}

TEST_F(Launch, ANodeIsAskedOnceWhenTheSupervisorDies) {
  const std::string in = folder_.path() + "/";  // a signal interrupts `wait` at once
  auto launch = start("nodes:\n  a: {exec: " + counter_ +
                      "}\n  b: {exec: sh, ready: started, args: [-c, \"trap 'echo t >> " + in +
                      "terms' TERM; sleep 1000 & echo > " + in + "up; wait; sleep 0.5; exit\"]}\n");
  ASSERT_TRUE(until([&] { return pids().contains("a"); }));
  ASSERT_TRUE(until_written("up", "\n"));
  kill(parent(pids().at("a")), SIGKILL);
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_EQ(folder_.read("terms"), "t\n");
}

TEST_F(NoOrphan, AfterAnInterrupt) {
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130);
  EXPECT_TRUE(all_gone());
  EXPECT_EQ(left_in_graph(), std::vector<std::string>{});
}

TEST_F(Launch, ResultIsTheLastLine) {
  auto launch =
      start("nodes:\n  a: {exec: " + undescribed() +
            ", params: {rate_hz: 100}}\nresult:\n  until: a/out\n  success: a/out.seq\n  fields:\n"
            "    topic: a/out.topic\n    seq: {from: a/out.seq, scale: 0.5, digits: 1}\n");
  EXPECT_EQ(launch->wait(), 1);  // a/out.seq is not `true`
  const json line = last_line(*launch);
  EXPECT_EQ(line["topic"], "counter");
  EXPECT_EQ(line["seq"], false);  // the success field says whether the run succeeded
  EXPECT_TRUE(line.contains("wall_s") && line.contains("graph_s"));
  EXPECT_EQ(line["log"], folder_.path() + "/mimesis/log/run");
}

TEST_F(Launch, ResultWithoutConditionSucceedsWithTheFirstMessage) {
  auto launch =
      start("nodes:\n  a: {exec: " + counter_ +
            "}\nresult: {until: a/out, fields: {n: {from: a/out.seq, scale: 0.5, digits: 1}}}\n");
  EXPECT_EQ(launch->wait(), 0) << launch->errors();
  const json line = last_line(*launch);
  EXPECT_EQ(line["n"], 0.5);  // the first message: none was lost
  EXPECT_EQ(line["success"], true);
}

TEST_F(Launch, ResultTellsOfTheDeathOfTheSupervisor) {
  auto launch = start("nodes:\n  a: {exec: " + undescribed() +
                      "}\nresult: {until: a/other, fields: {n: a/out.seq}}\n");
  ASSERT_TRUE(until([&] { return pids().contains("a"); }));
  kill(parent(pids().at("a")), SIGKILL);
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_EQ(last_line(*launch)["success"], false);
  EXPECT_EQ(last_line(*launch)["reason"], "the launcher was killed by SIGKILL");
}

TEST_F(Launch, ALogThatIsNotWholeIsAFailure) {
  auto launch = start(recorded(""));
  pid_t recorder = 0;
  ASSERT_TRUE(until([&] {
    const auto all = pids();
    for (const auto& [name, pid] : all) recorder = name.starts_with("tap-") ? pid : recorder;
    return recorder != 0 && all.contains("a");
  })) << launch->errors();
  kill(recorder, SIGKILL);
  ASSERT_TRUE(until([&] { return !alive(recorder); }));
  folder_.write("go", "");
  EXPECT_EQ(launch->wait(), 1) << launch->errors();
  EXPECT_EQ(
      summary(*launch)["reason"],
      "node 'end' ended with exit code 0; the log is not whole: node 'r' was killed by SIGKILL");

  std::filesystem::remove(folder_.path() + "/go");
  launch = start(recorded(", --min-free, 99.9%"));
  ASSERT_TRUE(until([&] {
    return launch->errors().find("node 'r' ended with exit code 1") != std::string::npos;
  })) << launch->errors();
  folder_.write("go", "");
  EXPECT_EQ(launch->wait(), 1) << launch->errors();
  EXPECT_NE(summary(*launch)["reason"].get<std::string>().find(
                "the log is not whole: node 'r' ended with exit code 1: recording stopped: "),
            std::string::npos);
}

TEST_F(Launch, RemovesWhatAKilledRunHasLeftAndNothingOfALivingNode) {
  const std::string folder = graph_.directory();
  const testing::Process live(graph_, counter_, {"--name", "live"});
  ASSERT_TRUE(until([&] { return pids().contains("live"); }));
  const auto of_live = left_in_graph();
  EXPECT_EQ(of_live.size(), 6U);  // entry, lock, three sockets, wall_clock
  for (const char* file : {"/dead-1.s", "/dead-77.d", "/gone-2-3.r", "/clock.sock", "/nodes/dead",
                           "/nodes/.dead", "/nodes/.gone.new"}) {
    std::ofstream(folder + file) << "x";
  }
  auto launch = start("nodes:\n  a: {exec: " + counter_ + "}\n");
  ASSERT_TRUE(until([&] { return pids().contains("a"); }));
  EXPECT_EQ(left_in_graph().size(), 11U);  // before the first node starts
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
  EXPECT_EQ(left_in_graph(), of_live);
}

TEST_F(Launch, RemovesSocketsOfDevicesThatNobodyHasBound) {
  const std::filesystem::path folder = graph_.directory();
  const auto bound = [&](const std::string& name, int type) {
    const int fd = socket(AF_UNIX, type | SOCK_CLOEXEC, 0);
    sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
    const std::string path = folder / name;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path());
    path.copy(address.sun_path, sizeof address.sun_path - 1);
    EXPECT_EQ(bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    return fd;
  };
  for (const int dead : {bound("can-dead/1.0", SOCK_DGRAM), bound("dead.modbus", SOCK_STREAM)})
    close(dead);
  const int frames = bound("can-live/2.0", SOCK_DGRAM),
            requests = bound("live.modbus", SOCK_STREAM);
  auto launch = start("nodes:\n  a: {exec: " + counter_ + "}\n");
  ASSERT_TRUE(until([&] { return pids().contains("a"); }));
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);
  EXPECT_EQ(left_in_graph(), (std::vector<std::string>{"2.0", "live.modbus"}));
  EXPECT_FALSE(std::filesystem::exists(folder / "can-dead"));
  EXPECT_TRUE(std::filesystem::exists(folder / "nodes"));
  close(frames), close(requests);
}

TEST_F(Launch, LockstepStartsTheClockAndGivesTheSameResultTwice) {
  std::vector<json> lines;
  for (int i = 0; i < 2; ++i) {
    auto launch =
        start("clock: lockstep\nnodes:\n  a: {exec: " + counter_ + "}\n  b: {exec: " + counter_ +
              ", params: {rate_hz: 1}, in: {a: a/out}}\n"
              "result: {until: b/out, fields: {hash: b/out.start_id, seq: a/out.seq}}\n");
    EXPECT_EQ(launch->wait(), 0) << launch->errors();
    EXPECT_EQ(summary(*launch)["nodes"][0]["name"], "clock");
    lines.push_back(last_line(*launch));
    lines.back().erase("wall_s");
  }
  EXPECT_EQ(lines[0], lines[1]);
}

TEST_F(Launch, NobodyWaitsForTheLauncherOnceTheResultIsThere) {
  auto launch = start("clock: lockstep\nnodes:\n  a: {exec: " + counter_ +
                      ", required: true, params: {rate_hz: 1000}, stop: {order: last}}\n"
                      "  slow: {exec: sh, ready: started, args: [-c, \"trap 'sleep 1; exit 0' INT; "
                      "sleep 1000 & wait\"]}\nresult: {until: a/out}\n");
  EXPECT_EQ(launch->wait(), 0) << launch->errors();
  EXPECT_EQ(last_line(*launch)["success"], true) << "a was killed: " << launch->errors();
}

TEST_F(Launch, ResultTellsOfTheDeathOfANode) {
  auto launch = start("nodes:\n  a: {exec: " + undescribed() +
                      ", required: true, params: {fail_at_step: 3}}\n"
                      "result: {until: a/other, fields: {n: a/out.seq}}\n");
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_EQ(last_line(*launch)["success"], false);
  EXPECT_EQ(last_line(*launch)["reason"], "node 'a' ended with exit code 1");
}

TEST_F(Launch, ResultTellsOfTheTimeOut) {
  auto launch = start("nodes:\n  a: {exec: " + undescribed() +
                      "}\nresult: {until: a/other, timeout: 300ms, fields: {n: a/out.seq}}\n");
  EXPECT_EQ(launch->wait(), 1);
  EXPECT_EQ(last_line(*launch)["reason"], "nothing on a/other within 0.3 s of graph time");
}

TEST_F(Launch, ResultFieldThatTheTypeLacksIsAMistakeOfTheFile) {
  auto launch = start("nodes:\n  a: {exec: " + undescribed() +
                      "}\nresult: {until: a/out, fields: {n: a/out.sq}}\n");
  EXPECT_EQ(launch->wait(), 2);
  EXPECT_NE(last_line(*launch)["reason"].get<std::string>().find(
                "g.yaml:4:36: mimesis.v1.Publication has no "
                "field 'sq', did you mean 'seq'?"),
            std::string::npos)
      << last_line(*launch);
}

TEST_F(Launch, CheckReadsTheParametersOfTheNodes) {
  auto launch =
      start("nodes:\n  a:\n    exec: " + counter_ +
                "\n    params:\n      rate_hz: 0\n      wrok: 3\n  b: {exec: " + counter_ + "}\n",
            {"--check", "--set", "b.work=-1"});
  EXPECT_EQ(launch->wait(), 2);
  const json found = mistakes(*launch);
  ASSERT_EQ(found.size(), 3U) << found;
  const std::string file = folder_.path() + "/g.yaml";
  EXPECT_EQ(found[0], json({{"file", file},
                            {"line", 6},
                            {"column", 16},
                            {"message", "counter.rate_hz: 0 is outside [0.1, 10000]"},
                            {"expected", "[0.1, 10000]"},
                            {"suggestion", nullptr},
                            {"severity", "error"}}));
  EXPECT_EQ(found[1]["line"], 7);
  EXPECT_EQ(found[1]["suggestion"], "work");
  EXPECT_EQ(found[2]["file"], nullptr);
  EXPECT_EQ(found[2]["line"], nullptr);
  EXPECT_TRUE(
      found[2]["message"].get<std::string>().starts_with("--set: counter.work: -1 is outside"));
}

TEST_F(Launch, CheckFindsWhatCannotWork) {
  auto launch = start("nodes:\n  a: {exec: mimesis_nothing}\n  b: {exec: " + counter_ +
                          ", in: {a: aa/out}, host: moon}\n",
                      {"--check", "--set", "c.work=1"});
  EXPECT_EQ(launch->wait(), 2);
  const json found = mistakes(*launch);
  ASSERT_EQ(found.size(), 4U) << found;
  EXPECT_EQ(found[0]["message"], "--set: c.work=1: there is no node 'c'");
  EXPECT_EQ(found[1]["line"], 3);
  EXPECT_EQ(found[1]["message"],
            "node 'a': there is no program 'mimesis_nothing' beside mimesis or on PATH");
  EXPECT_EQ(found[2]["line"], 4);
  EXPECT_EQ(found[2]["message"],
            "no node publishes 'aa/out', expected one with mimesis.v1.Publication, did you mean "
            "'a/out'?");
  EXPECT_EQ(found[3]["message"], "there is no host 'moon'");
}

TEST_F(Launch, CheckKnowsWhatASimulatedClockNeeds) {
  const std::string text = "clock: lockstep\nnodes:\n  clock: {exec: " + counter_ + "}\n";
  auto launch = start(text, {"--check"});
  EXPECT_EQ(launch->wait(), 2);
  EXPECT_EQ(mistakes(*launch).at(0)["line"], 4);
  EXPECT_EQ(mistakes(*launch).at(0)["message"],
            "the name 'clock' belongs to the node that the launcher starts");
  // A launcher without the clock beside it.
  const std::string alone = folder_.path() + "/mimesis-launch";
  std::filesystem::copy_file(MIMESIS_BIN_DIR "/mimesis-launch", alone);
  testing::Process check(alone, {folder_.path() + "/g.yaml", "--check"});
  EXPECT_EQ(check.wait(), 2);
  EXPECT_NE(check.errors().find("clock lockstep needs the program mimesis_clock"),
            std::string::npos)
      << check.errors();
}

/// `latest` of a counter obeys one node.
TEST_F(Launch, AnInputObeysWhoeverTheFileLetsPublishItsTopic) {
  const std::string planner = "nodes:\n  planner: {exec: " + counter_ + ", out: {out: arm/go}}\n",
                    arm = "  arm: {exec: " + counter_ + ", in: {latest: arm/go}}\n";
  auto launch = start(planner + arm +
                      "result: {until: arm/health, fields: {n: 'arm/health.inputs.0.received', "
                      "refused: 'arm/health.inputs.0.rejected'}}\n");
  EXPECT_EQ(launch->wait(), 0) << launch->errors();
  EXPECT_GT(last_line(*launch)["n"], 0) << last_line(*launch);
  EXPECT_EQ(last_line(*launch)["refused"], 0);

  const auto mistake = [&](const std::string& nodes) {
    auto check = start(nodes, {"--check"});
    EXPECT_EQ(check->wait(), 2) << check->errors();
    const json found = mistakes(*check);
    EXPECT_EQ(found.size(), 1U) << found;
    EXPECT_EQ(found.at(0)["column"], arm.find("arm/go") + 1);
    return found.at(0)["message"];
  };
  EXPECT_EQ(mistake(planner + arm + "  rival: {exec: " + counter_ + ", out: {out: arm/go}}\n"),
            "this input obeys one node, and the topic is published by planner,rival");
  EXPECT_EQ(
      mistake(planner + "  arm: {exec: " + counter_ + ", in: {latest: planner/out}}\n"),
      "no node publishes 'planner/out', expected one with mimesis.v1.Publication, did you mean "
      "'arm/go'?");
}

TEST_F(Launch, APlainLaunchChecksTheWiringBeforeItStarts) {
  auto launch = start("nodes:\n  a: {exec: " + counter_ + ", in: {latset: a/out}}\n");
  EXPECT_EQ(launch->wait(), 2);
  EXPECT_EQ(mistakes(*launch).at(0)["message"],
            "node 'a' has no input 'latset', expected a, b, latest, did you mean 'latest'?");
  EXPECT_EQ(
      mistakes(*launch).at(0)["column"],
      std::string("  a: {exec: ").size() + counter_.size() + std::string(", in: {").size() + 1);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/mimesis"));
}

/// A lock-step waited 5 s for every message of another type.
TEST_F(Launch, AnotherTypeOnAWireStopsTheRun) {
  const std::string text =
      "clock: lockstep\nnodes:\n  a: {exec: " + undescribed() + ", in: {latest: clock/time}}\n";
  auto launch = start(text);
  EXPECT_EQ(launch->wait(), 2) << launch->errors();
  EXPECT_EQ(summary(*launch)["reason"],
            "topic clock/time: node clock publishes mimesis.v1.ClockTime, node a expects "
            "mimesis.v1.Publication");
  auto check = start(text, {"--check"});
  EXPECT_EQ(check->wait(), 2);
  EXPECT_EQ(mistakes(*check).at(0)["message"],
            "'clock/time' carries mimesis.v1.ClockTime, expected mimesis.v1.Publication");
}

TEST_F(Launch, TopicsFromOutsideAndInputsLeftOutOnPurposeAreNoMistakes) {
  auto check = start("outside: [far/away]\nnodes:\n  a: {exec: " + counter_ +
                         ", in: {a: far/away, b: }}\nresult: {until: far/away}\n",
                     {"--check"});
  EXPECT_EQ(check->wait(), 0) << check->output();
  EXPECT_EQ(mistakes(*check), json::array());
}

/// Nodes read their parameters in the file and section where they are written, with its arguments.
TEST_F(Launch, RunsNodesThatAreIncludedAndRepeated) {
  folder_.write("part.yaml",
                "version: 1\nargs: {work: {type: int}}\ngroups:\n  all:\n    nodes:\n"
                "      n${arg:i}:\n        for: {i: [20, 50]}\n        exec: " +
                    counter_ +
                    "\n        params: {rate_hz: \"${arg:i}\", work: \"${arg:work}\"}\n"
                    "        in: {a: \"n${arg:i}/out\"}\n");
  const std::string text =
      "include:\n  - {file: part.yaml, namespace: p, args: {work: 3}}\n"
      "nodes:\n  last: {exec: " +
      counter_ + ", after: [p_all], in: {latest: p_n20/out}, params: {rate_hz: 10}}\n";
  auto launch = start(text, {"--set", "p_n50.rate_hz=40"});
  ASSERT_TRUE(until([&] { return pids().size() == 3; })) << launch->errors();
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130) << launch->errors();
  EXPECT_LT(launch->errors().find("p_n50 is ready"), launch->errors().find("last is ready"));
  EXPECT_NE(folder_.read("mimesis/log/run/p_n20.log").find("rate_hz=20 work=3"), std::string::npos)
      << folder_.read("mimesis/log/run/p_n20.log");
  EXPECT_NE(folder_.read("mimesis/log/run/p_n50.log").find("rate_hz=40 work=3"), std::string::npos)
      << folder_.read("mimesis/log/run/p_n50.log");

  // A mistake in an included file is found there, once.
  std::string part = folder_.read("part.yaml");
  folder_.write("part.yaml", part.replace(part.find("work: \"$"), 4, "wrok"));
  auto check = start(text, {"--check"});
  EXPECT_EQ(check->wait(), 2);
  const json found = mistakes(*check);
  ASSERT_EQ(found.size(), 1U) << found;
  EXPECT_EQ(found[0]["file"], folder_.path() + "/part.yaml");
  EXPECT_EQ(found[0]["line"], 9);
  EXPECT_EQ(found[0]["column"], 39);
  EXPECT_EQ(found[0]["suggestion"], "work");
}

TEST_F(Launch, HelpOfAFileSaysWhatItIs) {
  const std::string file = folder_.write(
      "help.yaml",
      "# An arm.\n#   mimesis launch help.yaml\n\nversion: 1\nargs:\n"
      "  log: {type: path, help: where}\n"
      "  sim: {type: bool, default: false, help: \"no arm\", implies: {bus: virtual}}\n"
      "  bus: {default: can0}\n"
      "hosts: {spine: {address: 10.0.0.1}}\n"
      "nodes:\n  arm: {exec: x, host: spine}\n  world: {exec: y, if: \"${arg:sim}\"}\n");
  testing::Process help("mimesis", {"launch", file, "--help"});
  EXPECT_EQ(help.wait(), 0) << help.errors();
  EXPECT_EQ(help.output(), file +
                               "\nAn arm.\n  mimesis launch help.yaml\n\n"
                               "Arguments (--arg NAME=VALUE; type, default):\n"
                               "  log  path      (needed)  where\n"
                               "  sim  bool      false     no arm\n"
                               "                           true implies bus=virtual\n"
                               "  bus  string    can0\n\n"
                               "Nodes:\n  arm                    x on spine\n"
                               "  world                  y (switched off)\n\n"
                               "Options of every launch: mimesis launch --help\n");
  testing::Process as_json("mimesis", {"launch", file, "--help", "--json", "--arg", "sim=true"});
  EXPECT_EQ(as_json.wait(), 0);
  const json told = json::parse(as_json.output());
  EXPECT_EQ(told["args"][1]["implies"], json({{"bus", "virtual"}}));
  EXPECT_EQ(told["args"][0]["default"], nullptr);
  EXPECT_EQ(told["nodes"][1]["enabled"], true);
  testing::Process general("mimesis", {"launch", "--help"});
  EXPECT_EQ(general.wait(), 0);
  EXPECT_NE(general.output().find("--dry-run"), std::string::npos);
}

TEST_F(Launch, DryRunStartsNothing) {
  auto launch =
      start("nodes:\n  b: {exec: " + counter_ + ", after: [a]}\n  a: {exec: " + counter_ + "}\n",
            {"--dry-run"});
  EXPECT_EQ(launch->wait(), 0);
  const json plan = json::parse(launch->output());
  EXPECT_EQ(plan["start"][0]["name"], "a");  // in order of start
  EXPECT_EQ(plan["stop"], json::parse(R"([["b"],["a"]])"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() + "/mimesis"));
}

TEST_F(Launch, ARecorderLearnsWhatItRecords) {
  auto launch = start(
      "args: {speed: {type: int, default: 2}, name: {type: string, default: x}}\n"
      "nodes:\n"
      "  a: {exec: " +
          counter_ +
          ", after: [r]}\n"
          "  r: {exec: mimesis, args: [log, record, --all, -o, x.mcap]}\n",
      {"--dry-run", "--arg", "name=y z", "--set", "a.work=3"});
  EXPECT_EQ(launch->wait(), 0) << launch->errors();
  const json plan = json::parse(launch->output());
  const json told = json::parse(plan["start"][0]["env"]["MIMESIS_LAUNCH"].get<std::string>());
  EXPECT_EQ(told["file"], folder_.path() + "/g.yaml");
  EXPECT_EQ(told["args"], json({"speed=2", "name=y z"}));
  EXPECT_EQ(told["sets"], json({"a.work=3"}));
  EXPECT_EQ(told["clock"], "wall");
  EXPECT_EQ(told["graph"], plan["graph"]);
  EXPECT_FALSE(plan["start"][1]["env"].contains("MIMESIS_LAUNCH"));
}

TEST_F(Launch, ShowsALineANodeAndWarnings) {
  const std::string nodes =
      "nodes:\n  a: {exec: " + counter_ +
      "}\n  b: {exec: sh, after: [a], ready: started, required: true, args: [-c, "
      "'echo \"[09:00:00.000] [b] info: hidden\" >&2; echo \"[09:00:00.000] [b] warning: shown\" "
      ">&2; echo plain']}\n";
  auto quiet = start(nodes);
  EXPECT_EQ(quiet->wait(), 0) << quiet->errors();
  const std::string err = quiet->errors();
  EXPECT_EQ(err.find("info:"), std::string::npos) << err;
  EXPECT_NE(err.find("[b] 09:00:00.000 warning: shown\n"), std::string::npos) << err;
  EXPECT_NE(err.find("[b] plain\n"), std::string::npos) << err;
  EXPECT_EQ(err.find("a is ready"), err.rfind("a is ready")) << err;
  EXPECT_NE(folder_.read("mimesis/log/run/b.log").find("hidden"), std::string::npos);

  auto verbose = start(nodes, {"-v"});
  EXPECT_EQ(verbose->wait(), 0);
  EXPECT_NE(verbose->errors().find("[b] 09:00:00.000 info: hidden\n"), std::string::npos);
}

TEST_F(Launch, LogsOfOlderRunsAreBounded) {
  const auto old_run = [&](const std::string& name) {
    std::filesystem::create_directories(folder_.path() + "/mimesis/log/" + name);
    return folder_.write("mimesis/log/" + name + "/a.log", std::string(1000, 'x'));
  };
  const auto there = [](const std::string& file) { return std::filesystem::exists(file); };
  const std::string oldest = old_run("20200101-000000-x-1"),
                    second = old_run("20200102-000000-x-2"), named = old_run("20200101-kept");
  auto launch = start("nodes: {a: {exec: sh, ready: started, args: [-c, 'true']}}\n",
                      {"--log-limit", "2500B"});
  EXPECT_EQ(launch->wait(), 0) << launch->errors();
  EXPECT_FALSE(there(oldest));
  EXPECT_TRUE(there(second) && there(named));
  EXPECT_NE(launch->errors().find("removed the log of 20200101-000000-x-1 (1.0 kB)"),
            std::string::npos)
      << launch->errors();
}

TEST_F(Launch, MistakesEndWithTwo) {
  EXPECT_EQ(start("nodes: {a: {exec: sh, foo: 1}}\n")->wait(), 2);
  EXPECT_EQ(testing::Process("mimesis", {"launch", "/nowhere.yaml"}).wait(), 2);
  EXPECT_EQ(testing::Process("mimesis", {"launch"}).wait(), 2);
  testing::Process typo("mimesis", {"lanch", "x.yaml"});
  EXPECT_EQ(typo.wait(), 2);
  EXPECT_NE(typo.errors().find("did you mean 'launch'?"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::launch
