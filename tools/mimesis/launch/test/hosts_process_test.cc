// Graphs on several hosts as a user has them.
#include <nlohmann/json.hpp>

#include "tools/mimesis/launch/test/hosts_fixture.h"

namespace mimesis::launch {
namespace {

TEST_F(LaunchHosts, EveryHostSeesTheWholeGraphAndItStopsInReverse) {
  begin(3);
  if (HasFatalFailure()) return;
  start(counter("a", ", after: [b]") + counter("b", ", host: h2, after: [c], in: {a: c/out}") +
        counter("c", ", host: h3, in: {a: a/out}"));
  ASSERT_TRUE(all_see({"a", "b", "c", "launcher"})) << launch_->errors();
  const std::string err = launch_->errors();
  EXPECT_LT(err.find("c is ready"), err.find("b is ready"));
  EXPECT_LT(err.find("b is ready"), err.find("a is ready"));
  for (const auto& [host, topic] : {std::pair(1, "b/out"), std::pair(2, "c/out"),
                                    std::pair(3, "a/out"), std::pair(2, "launcher/hosts")}) {
    const auto echo = at(host).mimesis(std::string("topic echo --once --timeout 10 --graph ") +
                                       graph_ + " " + topic);
    EXPECT_EQ(echo->wait(15s), 0) << "host " << host << ", " << topic << ": " << echo->errors();
  }
  const auto check = at(1).mimesis("launch --check " + folder_.path() + "/g.yaml", path());
  EXPECT_EQ(check->wait(30s), 0) << check->errors();  // asks nodes there, too
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130) << launch_->errors();
  const auto report = nlohmann::json::parse(launch_->output());
  for (const auto& node : report["nodes"]) EXPECT_EQ(node["exit_code"], 0) << node;
  EXPECT_GE(all_gone(), 0.0);
  for (int n : {1, 2, 3}) EXPECT_TRUE(at(n).sees(graph_).empty()) << n;
}

/// Nodes of a host are asked through one connection, whose socket is gone at the end; a user's own
/// way to share connections is used instead.
TEST_F(LaunchHosts, ACheckConnectsToEachHostOnce) {
  begin(4);
  if (HasFatalFailure()) return;
  std::string nodes;
  for (int n = 1; n <= 4; ++n) {
    for (const char* name : {"a", "b"})
      nodes += counter(name + std::to_string(n), ", host: h" + std::to_string(n));
  }
  const std::string file = write_graph(nodes);
  const auto left = [&] {
    std::vector<std::string> names;
    for (const auto& entry :
         std::filesystem::directory_iterator(folder_.path() + "/h1/run/mimesis")) {
      const std::string name = entry.path().filename();
      if (name.starts_with("ssh-")) names.push_back(name);
    }
    return names;
  };
  ASSERT_TRUE(at(1).cut(at(3)));
  const auto one_away = at(1).mimesis("launch --check " + file, path());
  EXPECT_EQ(one_away->wait(60s), 2);
  const std::string said = one_away->errors(), what = "host 'h3' cannot be used: ssh ended with";
  EXPECT_NE(said.find(what), std::string::npos) << said;
  EXPECT_EQ(said.find(what), said.rfind(what)) << "once: " << said;
  ASSERT_TRUE(at(1).up(at(3)) && at(3).up(at(1)));
  for (const bool own : {false, true}) {
    if (own) {
      std::ofstream(folder_.path() + "/ssh_config", std::ios::app)
          << "  ControlMaster auto\n  ControlPath " << folder_.path()
          << "/own-%n\n  ControlPersist 5\n";
    }
    std::vector<int> before;
    for (const auto& host : hosts_) before.push_back(host->logins());
    const auto begin = Clock::now();
    const auto check = at(1).mimesis("launch --check " + file, path());
    EXPECT_EQ(check->wait(60s), 0) << check->errors();
    std::printf("%s: 6 nodes of 3 other hosts asked in %.2f s\n",
                own ? "the user's sockets" : "ours",
                std::chrono::duration<double>(Clock::now() - begin).count());
    EXPECT_EQ(left(), std::vector<std::string>());
    for (int n = 2; n <= 4; ++n) {
      const int logins = at(n).logins() - before[static_cast<std::size_t>(n - 1)];
      // Those that ask at once, before the user's first connection stands, have their own.
      EXPECT_LE(logins, own ? 3 : 1) << "h" << n;
      EXPECT_EQ(std::filesystem::exists(folder_.path() + "/own-" + at(n).address()), own);
    }
  }
  for (int n = 2; n <= 4; ++n)
    at(1).start(folder_.path() + "/bin/ssh -O exit " + at(n).address())->wait();
}

TEST_F(LaunchHosts, AddressesMayBeThoseOfIPv6) {
  begin(2);
  if (HasFatalFailure()) return;
  ipv6_ = true;
  for (const std::size_t first :
       {1, 2}) {  // the launching host is declared, or where ssh comes from
    start(counter("a", ", in: {a: b/out}") + counter("b", ", host: h2, in: {a: a/out}"), "", "",
          first);
    ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
    for (const auto& [host, topic] : {std::pair(1, " b/out"), std::pair(2, " a/out")}) {
      const auto echo =
          at(host).mimesis("topic echo --once --timeout 10 --graph " + graph_ + topic);
      EXPECT_EQ(echo->wait(15s), 0) << echo->errors() << launch_->errors();
    }
    launch_->signal(SIGINT);
    EXPECT_EQ(launch_->wait(), 130) << launch_->errors();
    EXPECT_GE(all_gone(), 0.0);
  }
}

/// The shipped file, figures on three hosts, started from the coordinator's.
TEST_F(LaunchHosts, FourHostsHaveACrowd) {
  if (access(MIMESIS_BIN_DIR "/mimesis_crowd", X_OK) != 0) GTEST_SKIP() << "no mimesis_crowd";
  begin(4);
  if (HasFatalFailure()) return;
  std::string words = "launch " MIMESIS_SOURCE_DIR
                      "/launch/crowd_four_hosts.yaml --arg until=5 --arg user=root "
                      "--arg prefix=" MIMESIS_BIN_DIR "/.. --graph " +
                      graph_;
  for (int n = 1; n <= 4; ++n) words += " --arg h" + std::to_string(n) + "=" + at(n).address();
  const auto check = at(1).mimesis(words + " --check", path());
  EXPECT_EQ(check->wait(60s), 0) << check->errors();
  launch_ = at(1).mimesis(words, path());
  EXPECT_TRUE(launch_->wait(90s)) << launch_->errors();
  std::string out = launch_->output();
  const auto result = nlohmann::json::parse(out.substr(0, out.rfind('}') + 1), nullptr, false);
  ASSERT_TRUE(result.is_object()) << out << launch_->errors();
  EXPECT_EQ(result["agents"], 15) << result << launch_->errors();
  EXPECT_GE(all_gone(), 0.0);
}

TEST_F(LaunchHosts, NothingIsLeftWhenTheLauncherIsKilled) {
  begin(2);
  if (HasFatalFailure()) return;
  start(counter("a") + counter("b", ", host: h2"));
  ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
  // The subreaper and the supervisor at once: nobody is left to tell anybody.
  const auto launcher = processes_with(std::string("launch\0", 7) + folder_.path());
  EXPECT_EQ(launcher.size(), 2U);
  for (const pid_t pid : launcher) kill(pid, SIGKILL);
  const double took_s = all_gone();
  std::printf("launcher killed with -9: all gone after %.2f s\n", took_s);
  EXPECT_GE(took_s, 0.0);
  EXPECT_LT(took_s, 10.0);
}

TEST_F(LaunchHosts, AHostThatIsCutOffComesBackWithItsNodes) {
  begin(2);
  if (HasFatalFailure()) return;
  start(counter("a", ", in: {a: b/out}") + counter("b", ", host: h2"), "", "", 2);
  ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
  const auto before = at(1).sees(graph_);
  ASSERT_TRUE(at(1).cut(at(2)));
  ASSERT_TRUE(until_says("host 'h2' is lost")) << launch_->errors();
  ASSERT_TRUE(at(1).up(at(2)) && at(2).up(at(1)));
  ASSERT_TRUE(until_says("host 'h2' is back")) << launch_->errors();
  EXPECT_TRUE(all_see({"a", "b", "launcher"}));
  EXPECT_EQ(at(1).sees(graph_), before) << "nobody has been started again";
  for (const auto& [host, topic] : {std::pair(1, " b/out"), std::pair(2, " a/out")}) {
    const auto echo =
        at(host).mimesis("topic echo --once --reliable --timeout 15 --graph " + graph_ + topic);
    EXPECT_EQ(echo->wait(20s), 0) << echo->errors();
  }
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130);
  EXPECT_GE(all_gone(), 0.0);
}

TEST_F(LaunchHosts, NodesOfAnEndedConnectionEndAndAreStartedAgain) {
  begin(2);
  if (HasFatalFailure()) return;
  start(counter("a") + counter("b", ", host: h2, restart: on-failure"), ", lost_after: 4s");
  ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
  const auto before = at(1).sees(graph_);
  // The session's sshd is killed: the program there has lost its launcher.
  at(2).end_sessions();
  ASSERT_TRUE(until_says("host 'h2' is lost")) << launch_->errors();
  ASSERT_TRUE(until_says("host 'h2' is back")) << launch_->errors();
  const auto again = [&] {
    const auto now = at(1).sees(graph_);
    return now.contains("b") && now.at("b") != before.at("b");
  };
  ASSERT_TRUE(until(again)) << launch_->errors();
  EXPECT_TRUE(says("b was lost with host 'h2'; starting it again")) << launch_->errors();
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130) << launch_->errors();
  EXPECT_GE(all_gone(), 0.0);
}

TEST_F(LaunchHosts, RefusesHostsThatDoNotTrustEachOtherAndThoseThatAreNotThere) {
  begin(2);
  if (HasFatalFailure()) return;
  const std::string key = at(1).told("key show");
  at(2).told("key new --replace");
  start(counter("a") + counter("b", ", host: h2"));
  EXPECT_EQ(launch_->wait(20s), 2);
  EXPECT_TRUE(says("this host does not trust host h2; there: mimesis key trust h2 '" +
                   at(2).told("key show") + "'"))
      << launch_->errors();
  start(counter("a") + counter("b", ", host: h2"), ", ssh: root@10.97.0.77");
  EXPECT_EQ(launch_->wait(20s), 2);
  EXPECT_TRUE(says("host 'h2' cannot be used: ssh ended with exit code 255: ssh: connect"))
      << launch_->errors();
  start(counter("b", ", host: h2"), "", "clock: lockstep\n");
  EXPECT_EQ(launch_->wait(20s), 2);
  EXPECT_NE(launch_->output().find("clock lockstep stays on one host, and node 'b' is on 'h2'"),
            std::string::npos);
}

/// A key that is taken back ends connections that it had opened, in both directions.
TEST_F(LaunchHosts, AKeyThatIsTakenBackIsHeardNoMore) {
  begin(2);
  if (HasFatalFailure()) return;
  start(counter("a") + counter("b", ", host: h2"));
  ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
  const std::string echo = "topic echo --reliable --graph " + graph_;
  const auto here = at(1).mimesis(echo + " b/out"), there = at(2).mimesis(echo + " a/out");
  ASSERT_TRUE(until([&] { return here->output().size() > 100 && there->output().size() > 100; }))
      << here->errors() << there->errors();
  const std::string key = at(2).told("key show");
  EXPECT_NE(at(1).told("key list --json --graph " + graph_).find(key + "\",\"nodes\":[\"b\"]"),
            std::string::npos);
  at(1).told("key untrust h2");
  const auto untrusted = std::chrono::steady_clock::now();
  ASSERT_TRUE(until([&] {
    return here->errors().find("not trusted any more") != std::string::npos;
  })) << here->errors();
  std::this_thread::sleep_until(untrusted + 2s);  // the promise
  const std::size_t heard_here = here->output().size(), heard_there = there->output().size();
  std::this_thread::sleep_for(1s);
  EXPECT_EQ(here->output().size(), heard_here);
  EXPECT_EQ(there->output().size(), heard_there);
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130);
}

TEST_F(LaunchHosts, GraphTimeIsOneAndClocksThatDifferAreNamed) {
  begin(2);
  if (HasFatalFailure()) return;
  const std::int64_t ahead_s = 7;
  std::ofstream(at(2).clock_file(), std::ios::binary)
      .write(reinterpret_cast<const char*>(&ahead_s), sizeof ahead_s);
  start(counter("a", ", in: {a: b/out}") + counter("b", ", host: h2"));
  ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
  EXPECT_TRUE(until_says("the system clock of host 'h2' is +70")) << launch_->errors();
  const auto field = [&](const std::string& topic, const std::string& path) {
    const auto echo =
        at(2).told("topic echo -n 2 --json --timeout 20 --graph " + graph_ + " " + topic);
    const auto last = nlohmann::json::parse(echo.substr(echo.rfind('\n') + 1), nullptr, false);
    return last.is_discarded() ? 1e9
                               : last["message"].value(nlohmann::json::json_pointer(path), 1e9);
  };
  const double system_s = field("launcher/hosts", "/system_ahead_s");
  const double graph_s = field("launcher/hosts", "/graph_ahead_s");
  const double age_s = field("a/health", "/inputs/0/age_s");  // of what host 2 has stamped
  std::printf("system clock %+.6f s, graph time %+.6f s, age %.6f s\n", system_s, graph_s, age_s);
  EXPECT_NEAR(system_s, 7.0, 0.5);
  EXPECT_NEAR(graph_s, 0.0, 0.5);
  EXPECT_NEAR(age_s, 0.0, 1.0);
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130);
}

}  // namespace
}  // namespace mimesis::launch
