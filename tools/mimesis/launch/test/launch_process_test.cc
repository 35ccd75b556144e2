// Starts, failures and stops.
#include <sys/socket.h>
#include <sys/un.h>

#include "tools/mimesis/launch/test/launch_fixture.h"

namespace mimesis::launch {
namespace {

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

TEST_F(Launch, IsStoppedInOrderWhenItsTimeIsOver) {
  auto launch = start("nodes:\n  a: {exec: " + counter_ + "}\n", {"--timeout", "0.7"});
  EXPECT_EQ(launch->wait(), 3) << launch->errors();
  EXPECT_EQ(summary(*launch)["reason"], "--timeout: the run had 0.7 s");
  EXPECT_EQ(summary(*launch)["nodes"][0]["exit_code"], 0);
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
  EXPECT_TRUE(
      std::string(summary(*launch)["reason"]).starts_with("node 'mute' was not ready within 0.2 s"))
      << summary(*launch)["reason"];
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
  EXPECT_GT(std::chrono::steady_clock::now() - stopped, 500ms);
  EXPECT_EQ(launch->wait(), 1);
  const std::string line = launch->errors().substr(launch->errors().find("b hangs") + 1);
  EXPECT_EQ(line.find("b hangs"), std::string::npos) << "said once: " << launch->errors();
  EXPECT_TRUE(std::string(summary(*launch)["reason"]).starts_with("node 'b' hung for "))
      << summary(*launch);
  EXPECT_NE(launch->errors().find("(stopped by a signal)"), std::string::npos);

  launch = start_two("");
  kill(pids().at("b"), SIGSTOP);
  ASSERT_TRUE(said(*launch, "b hangs")) << launch->errors();
  kill(pids().at("b"), SIGCONT);
  EXPECT_TRUE(said(*launch, "b goes on after ")) << launch->errors();
  launch->signal(SIGINT);
  EXPECT_EQ(launch->wait(), 130);

  launch = start_two(", params: {hang_at_step: 50, hang_busy: true}, hung_after: 60s");
  EXPECT_TRUE(said(*launch, "b computes one step for ")) << launch->errors();
  EXPECT_TRUE(said(*launch, " so far, 60 s are allowed")) << launch->errors();
  EXPECT_EQ(launch->errors().find("hangs"), std::string::npos) << "a long step is none";
  kill(pids().at("b"), SIGKILL);
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
  EXPECT_TRUE(std::string(summary(*launch)["reason"]).starts_with("the launcher hung for "))
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
  EXPECT_TRUE(std::string(summary(*launch)["reason"]).starts_with("node 'a' hung for "));
  EXPECT_EQ(launch->errors().find("b hangs"), std::string::npos) << launch->errors();
}

TEST_F(Launch, RealTimePriorityIsGrantedOrTheRunRefused) {
  if (geteuid() != 0) GTEST_SKIP() << "not here: needs root";
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
  EXPECT_TRUE(
      std::string(last_line(*launch)["reason"]).ends_with("node 'deaf' did not stop in time"));
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

}  // namespace
}  // namespace mimesis::launch
