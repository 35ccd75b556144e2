// The real launcher, sshd and nodes on hosts of their own: network namespaces joined by wires.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "common/testing/net_host.h"
#include "tools/mimesis/launch/test/graph_text.h"

namespace mimesis::launch {
namespace {
using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using testing::NetHost;
using testing::Process;

int run(const std::string& program, const std::vector<std::string>& arguments) {
  return Process(program, arguments).wait().value_or(-1);
}

/// Processes whose command line or environment has this text.
std::set<pid_t> processes_with(const std::string& text) {
  std::set<pid_t> found;
  std::error_code gone;
  for (const auto& entry : std::filesystem::directory_iterator("/proc", gone)) {
    const std::string name = entry.path().filename();
    if (name.find_first_not_of("0123456789") != std::string::npos) continue;
    std::ifstream in(entry.path() / "cmdline");
    const std::string line{std::istreambuf_iterator<char>(in), {}};
    if (line.find(text) != std::string::npos && std::stoi(name) != getpid())
      found.insert(std::stoi(name));
  }
  return found;
}

/// A host with an sshd, and folders that are no other host's: the file system is one.
class SshHost : public NetHost {
 public:
  SshHost(const TemporaryFolder& folder, int number)
      : NetHost(number), folder_(folder.path() + "/h" + std::to_string(number)) {
    for (const char* name : {"/run", "/config", "/state"})
      std::filesystem::create_directories(folder_ + name);
    std::ofstream(folder_ + "/sshd_config")
        << "Port 22\nListenAddress " << address() << "\nHostKey " << folder.path()
        << "/host_key\nAuthorizedKeysFile " << folder.path()
        << "/user_key.pub\nStrictModes no\nUsePAM no\nPermitRootLogin yes\nPidFile none\n"
           "MaxStartups 100\nPasswordAuthentication no\nSetEnv "
        << environment("MIMESIS_TEST_CLOCK=" + clock_file() +
                       " LD_PRELOAD=" MIMESIS_PRELOADED_CLOCK)
        << "\n";
  }
  std::string environment(const std::string& more = "") const {
    return "XDG_RUNTIME_DIR=" + folder_ + "/run XDG_CONFIG_HOME=" + folder_ +
           "/config XDG_STATE_HOME=" + folder_ + "/state " + more;
  }
  std::string clock_file() const { return folder_ + "/clock"; }
  void serve() { sshd_ = start("exec /usr/sbin/sshd -D -e -f " + folder_ + "/sshd_config"); }
  std::string says() const { return sshd_->errors(); }
  /// kill -9 of the processes of sshd that serve connections.
  void end_sessions() const {
    const std::string task = std::to_string(sshd_->pid());
    std::ifstream children("/proc/" + task + "/task/" + task + "/children");
    for (pid_t pid = 0; children >> pid;) kill(pid, SIGKILL);
  }
  /// Runs `mimesis WORDS` there.
  std::unique_ptr<Process> mimesis(const std::string& words, const std::string& path = "") const {
    return start("export " + environment() + "; " + path + "exec " MIMESIS_BIN_DIR "/mimesis " +
                 words);
  }
  /// What `mimesis WORDS` prints, without the end of the line.
  std::string told(const std::string& words) const {
    const auto p = mimesis(words);
    p->wait();
    std::string text = p->output();
    while (text.ends_with('\n')) text.pop_back();
    return text;
  }
  /// Start of each ready node that is seen there, by name.
  std::map<std::string, std::uint64_t> sees(const std::string& graph) const {
    setenv("XDG_RUNTIME_DIR", (folder_ + "/run").c_str(), 1);
    std::map<std::string, std::uint64_t> seen;
    for (const v1::NodeInfo& node : runtime::GraphView(graph).nodes()) {
      if (node.ready() && !node.name().starts_with("tap-")) seen[node.name()] = node.start_id();
    }
    return seen;
  }

 private:
  std::string folder_;
  std::unique_ptr<Process> sshd_;
};

class LaunchHosts : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string why = NetHost::missing();
    if (access("/usr/sbin/sshd", X_OK) != 0) why = "no /usr/sbin/sshd here";
    if (!why.empty()) GTEST_SKIP() << why;
  }
  /// `number` hosts, each wired to each; with `keys` they trust each other.
  void begin(int number, bool keys = true) {
    mkdir("/run/sshd", 0755);
    for (const char* key : {"/host_key", "/user_key"}) {
      ASSERT_EQ(
          run("/usr/bin/ssh-keygen", {"-q", "-t", "ed25519", "-N", "", "-f", folder_.path() + key}),
          0);
    }
    std::string known = folder_.read("host_key.pub");
    folder_.write("known_hosts", "10.97.0.* " + known);
    folder_.write("ssh_config", "Host *\n  IdentityFile " + folder_.path() +
                                    "/user_key\n  IdentitiesOnly yes\n  UserKnownHostsFile " +
                                    folder_.path() + "/known_hosts\n  StrictHostKeyChecking yes\n");
    std::filesystem::create_directory(folder_.path() + "/bin");
    chmod(folder_
              .write("bin/ssh",
                     "#!/bin/sh\nexec /usr/bin/ssh -F " + folder_.path() + "/ssh_config \"$@\"\n")
              .c_str(),
          0755);
    for (int n = 1; n <= number; ++n) {
      hosts_.push_back(std::make_unique<SshHost>(folder_, n));
      ASSERT_TRUE(at(n).made());
      for (int other = 1; other < n; ++other) ASSERT_EQ(at(n).wire(at(other)), "");
      at(n).serve();
    }
    for (int n = 1; keys && n <= number; ++n) at(n).told("key new");
    for (int n = 1; keys && n <= number; ++n) {
      for (int other = 1; other <= number; ++other) {
        if (n != other)
          at(n).told("key trust h" + std::to_string(other) + " '" + at(other).told("key show") +
                     "'");
      }
    }
    for (int n = 1; n <= number; ++n) {
      const auto probe = [&] {
        return at(1)
                   .start("exec " + folder_.path() + "/bin/ssh -o BatchMode=yes " +
                          at(n).address() + " true")
                   ->wait() == 0;
      };
      ASSERT_TRUE(until(probe)) << at(n).says();
    }
  }
  SshHost& at(int number) { return *hosts_[static_cast<std::size_t>(number - 1)]; }

  /// Starts the nodes on hosts h1 (this one, declared only if `first` is 1), h2 ...
  void start(const std::string& nodes, const std::string& more = "", const std::string& top = "",
             std::size_t first = 1) {
    std::string text = "version: 1\n" + top + "hosts:\n";
    for (std::size_t n = first; n <= hosts_.size(); ++n) {
      text += "  h" + std::to_string(n) + ": {address: 10.97.0." + std::to_string(n) +
              ", user: root, prefix: " MIMESIS_BIN_DIR "/.." + more + "}\n";
    }
    launch_ = at(1).mimesis("launch " + folder_.write("g.yaml", text + "nodes:\n" + nodes) +
                                " --json --graph " + graph_,
                            "export PATH=" + folder_.path() + "/bin:$PATH; ");
  }
  bool until(const std::function<bool()>& done, Clock::duration most = 20s) {
    const auto end = Clock::now() + most;
    while (!done()) {
      if (Clock::now() > end) return false;
      std::this_thread::sleep_for(10ms);
    }
    return true;
  }
  bool says(const std::string& text) { return launch_->errors().find(text) != std::string::npos; }
  bool until_says(const std::string& text, Clock::duration most = 20s) {
    return until([&] { return says(text); }, most);
  }
  /// All of these are seen from every host.
  bool all_see(const std::set<std::string>& names, Clock::duration most = 20s) {
    return until(
        [&] {
          return std::ranges::all_of(hosts_, [&](const auto& host) {
            std::set<std::string> seen;
            for (const auto& [name, start] : host->sees(graph_)) seen.insert(name);
            return seen == names;
          });
        },
        most);
  }
  /// Seconds until no process of the run is left; -1: not within 20 s.
  double all_gone() {
    const auto begin = Clock::now();
    const bool gone = until([&] { return processes_with(graph_).empty(); });
    return gone ? std::chrono::duration<double>(Clock::now() - begin).count() : -1.0;
  }
  static std::string counter(const std::string& name, const std::string& more = "") {
    return "  " + name + ": {exec: " MIMESIS_COUNTER + more + "}\n";
  }

  TemporaryFolder folder_;
  const std::string graph_ = "hosts-" + std::to_string(getpid());
  std::vector<std::unique_ptr<SshHost>> hosts_;
  std::unique_ptr<Process> launch_;
};

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
  const auto check = at(1).mimesis("launch --check " + folder_.path() + "/g.yaml",
                                   "export PATH=" + folder_.path() + "/bin:$PATH; ");
  EXPECT_EQ(check->wait(30s), 0) << check->errors();  // asks nodes there, too
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130) << launch_->errors();
  const auto report = nlohmann::json::parse(launch_->output());
  for (const auto& node : report["nodes"]) EXPECT_EQ(node["exit_code"], 0) << node;
  EXPECT_GE(all_gone(), 0.0);
  for (int n : {1, 2, 3}) EXPECT_TRUE(at(n).sees(graph_).empty()) << n;
}

/// The shipped file, each coordinator on a host of its own, started from the first.
TEST_F(LaunchHosts, FourHostsCoordinateACrowd) {
  if (access(MIMESIS_BIN_DIR "/mimesis_crowd", X_OK) != 0) GTEST_SKIP() << "no mimesis_crowd";
  begin(4);
  if (HasFatalFailure()) return;
  std::string words = "launch " MIMESIS_SOURCE_DIR
                      "/launch/crowd_four_hosts.yaml --arg until=5 --arg user=root "
                      "--arg prefix=" MIMESIS_BIN_DIR "/.. --graph " +
                      graph_;
  for (int n = 1; n <= 4; ++n) words += " --arg h" + std::to_string(n) + "=" + at(n).address();
  const std::string path = "export PATH=" + folder_.path() + "/bin:$PATH; ";
  const auto check = at(1).mimesis(words + " --check", path);
  EXPECT_EQ(check->wait(60s), 0) << check->errors();
  launch_ = at(1).mimesis(words, path);
  EXPECT_TRUE(launch_->wait(90s)) << launch_->errors();
  std::string out = launch_->output();
  const auto result = nlohmann::json::parse(out.substr(0, out.rfind('}') + 1), nullptr, false);
  ASSERT_TRUE(result.is_object()) << out << launch_->errors();
  EXPECT_EQ(result["coordinators"], 4);
  EXPECT_EQ(result["agents"], 16) << result << launch_->errors();
  EXPECT_GE(all_gone(), 0.0);
}

TEST_F(LaunchHosts, NothingIsLeftWhenTheLauncherIsKilled) {
  begin(2);
  if (HasFatalFailure()) return;
  start(counter("a") + counter("b", ", host: h2"));
  ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
  // The keeper and the supervisor at once: nobody is left to tell anybody.
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

// It overhears a handshake and says it again; it scans, talks rubbish and holds 10 000 connections.
TEST_F(LaunchHosts, DISABLED_SlowAStrangerGetsAndGivesNothing) {
  begin(3);
  if (HasFatalFailure()) return;
  const std::unique_ptr<SshHost> third = std::move(hosts_.back());
  hosts_.pop_back();
  const std::string script = MIMESIS_SOURCE_DIR "/tools/mimesis/launch/test/stranger.py ",
                    file = folder_.path() + "/heard", ports = " 7100 7101 7102";  // of b
  const auto overhears = at(2).start("exec " + script + "overhear " + file + " 8" + ports);
  start(counter("a", ", in: {a: b/out}, params: {rate_hz: 200}") +
            counter("b", ", host: h2, in: {a: a/out}, params: {rate_hz: 200}"),
        ", first_port: 7100");
  ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
  const auto before = at(1).sees(graph_);
  ASSERT_EQ(overhears->wait(20s), 0) << overhears->errors();
  const auto attacks = third->start("exec " + script + "attack " + file + " 10.97.0.2" + ports);
  EXPECT_EQ(attacks->wait(120s), 0) << attacks->errors();
  const auto told = nlohmann::json::parse(attacks->output());
  std::printf("stranger: %s\n%s", told.dump().c_str(), launch_->errors().c_str());
  EXPECT_GE(told["open"], 3);
  EXPECT_GE(told["replayed"], 1);
  EXPECT_GE(told["held"], 9000);
  for (const auto& [host, node] : {std::pair(1, "a"), std::pair(2, "b")}) {
    const auto health = nlohmann::json::parse(
        at(host).told(std::string("topic echo --once --json --timeout 10 --graph ") + graph_ + " " +
                      node + "/health"));
    const auto& input = health["message"]["inputs"][0];
    EXPECT_GT(input["received"], 1000) << health;
    EXPECT_EQ(input["lost"], 0) << health;
    EXPECT_LT(input["age_s"], 0.5) << health;
  }
  EXPECT_EQ(at(1).sees(graph_), before) << "nobody has been started again";
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(20s), 130) << launch_->errors();
  EXPECT_GE(all_gone(), 0.0);
}

TEST_F(LaunchHosts, DISABLED_SlowNodesOfALostHostEndAndAreStartedAgain) {
  begin(2);
  if (HasFatalFailure()) return;
  start(counter("a") + counter("b", ", host: h2, restart: on-failure"), ", lost_after: 4s");
  ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
  const auto before = at(1).sees(graph_);
  const auto again = [&] {
    const auto now = at(1).sees(graph_);
    return now.contains("b") && now.at("b") != before.at("b");
  };
  ASSERT_TRUE(at(1).cut(at(2)));  // for longer than lost_after
  ASSERT_TRUE(until([&] { return !at(2).sees(graph_).contains("b"); })) << launch_->errors();
  ASSERT_TRUE(until_says("no sign of life for 4 s; its nodes end by themselves"));
  ASSERT_TRUE(at(1).up(at(2)) && at(2).up(at(1)));
  ASSERT_TRUE(until(again)) << launch_->errors();
  ASSERT_TRUE(at(1).cut(at(2)));  // and a stop while it is away
  ASSERT_TRUE(until([&] {
    return launch_->errors().rfind("is lost: no sign of life for 2 s") >
           launch_->errors().rfind("is back");
  }));
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(20s), 130) << launch_->errors();
  EXPECT_GE(all_gone(), 0.0);
}

TEST_F(LaunchHosts, DISABLED_SlowTheArmStopsWhenTheHostThatCommandsItIsCutOff) {
  begin(2);
  if (HasFatalFailure()) return;
  std::ifstream in(MIMESIS_SOURCE_DIR "/launch/imitation.yaml");
  const std::string file{std::istreambuf_iterator<char>(in), {}};
  std::string nodes = file.substr(file.find("  sim_drives:"));
  nodes.resize(nodes.find("result:"));
  const auto replace = [&](const std::string& from, const std::string& to) {
    for (std::size_t at; (at = nodes.find(from)) != std::string::npos;)
      nodes.replace(at, from.size(), to);
  };
  replace("    after: [recorder]\n", "");
  replace(", recorder]", "]");
  replace("${arg:teacher}", "precision,above,high");
  for (const std::string node : {"planner", "cognition", "vision", "camera"}) {
    if (access((MIMESIS_BIN_DIR "/mimesis_" + node).c_str(), X_OK) != 0)
      GTEST_SKIP() << "mimesis_" << node << " is not built";
    replace("exec: mimesis_" + node + "\n", "exec: \"mimesis_" + node + "\"\n    host: h2\n");
  }
  start(nodes);
  std::string reason;
  const auto state = [&] {
    const auto told =
        at(1).told("topic echo --once --json --timeout 5 --graph " + graph_ + " bridge/status");
    const auto json = nlohmann::json::parse(told, nullptr, false);
    if (json.is_discarded()) return std::string();
    reason = json["message"].value("reason", "");
    return json["message"].value("state", "");
  };
  ASSERT_TRUE(until([&] { return state() == "following"; }, 90s)) << launch_->errors();
  ASSERT_TRUE(at(1).cut(at(2)));
  const auto begin = Clock::now();
  std::string stopped;
  ASSERT_TRUE(until([&] { return (stopped = state()) != "following"; })) << launch_->errors();
  std::printf("cut off: the bridge is in state %s (%s) after %.2f s\n", stopped.c_str(),
              reason.c_str(), std::chrono::duration<double>(Clock::now() - begin).count());
  EXPECT_NE(reason, "");
  ASSERT_TRUE(until_says("host 'h2' is lost")) << launch_->errors();
  ASSERT_TRUE(at(1).up(at(2)) && at(2).up(at(1)));
  ASSERT_TRUE(until_says("host 'h2' is back", 60s)) << launch_->errors();
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(20s), 130) << launch_->errors();
  EXPECT_GE(all_gone(), 0.0);
}

TEST_F(LaunchHosts, DISABLED_SlowTenSecondsCutAndWhatIsKilledLeavesNothing) {
  begin(2);
  if (HasFatalFailure()) return;
  const std::string nodes = counter("a", ", in: {a: b/out}") +
                            counter("b", ", host: h2, restart: on-failure, in: {a: a/out}");
  start(nodes);
  ASSERT_TRUE(all_see({"a", "b", "launcher"})) << launch_->errors();
  const auto before = at(1).sees(graph_);
  ASSERT_TRUE(at(1).cut(at(2)));
  std::this_thread::sleep_for(10s);
  ASSERT_TRUE(at(1).up(at(2)) && at(2).up(at(1)));
  ASSERT_TRUE(until_says("host 'h2' is back", 60s)) << launch_->errors();
  EXPECT_EQ(at(1).sees(graph_), before);
  launch_->signal(SIGINT);
  EXPECT_EQ(launch_->wait(), 130);
  ASSERT_GE(all_gone(), 0.0);
  double longest_s = 0.0;
  for (int trial = 0; trial < 20; ++trial) {
    start(nodes);
    ASSERT_TRUE(until_says("b is ready")) << launch_->errors();
    std::vector<pid_t> victims;
    for (const pid_t pid : processes_with(graph_)) victims.push_back(pid);
    const pid_t victim = victims[static_cast<std::size_t>(std::rand()) % victims.size()];
    std::ifstream in("/proc/" + std::to_string(victim) + "/cmdline");
    std::string line{std::istreambuf_iterator<char>(in), {}};
    std::ranges::replace(line, '\0', ' ');
    kill(victim, SIGKILL);
    std::this_thread::sleep_for(std::chrono::milliseconds(std::rand() % 2000));
    launch_->signal(SIGINT);
    EXPECT_TRUE(launch_->wait(30s)) << launch_->errors();
    const double took_s = all_gone();
    EXPECT_GE(took_s, 0.0) << line;
    longest_s = std::max(longest_s, took_s);
    std::printf("%2d: all gone %.2f s after the launcher; killed: %.60s\n", trial, took_s,
                line.c_str());
  }
  std::printf("20 kills: nothing left, at most %.2f s after the launcher\n", longest_s);
}

}  // namespace
}  // namespace mimesis::launch
