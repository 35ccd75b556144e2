#pragma once
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "common/machine_time.h"
#include "common/testing/net_host.h"
#include "tools/mimesis/launch/test/graph_text.h"

namespace mimesis::launch {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using testing::NetHost;
using testing::Process;

inline int run(const std::string& program, const std::vector<std::string>& arguments) {
  return Process(program, arguments).wait().value_or(-1);
}

/// Processes whose command line or environment has this text.
inline std::set<pid_t> processes_with(const std::string& text) {
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
  SshHost(const TemporaryFolder& folder, int number, bool own)
      : NetHost(number, own), folder_(folder.path() + "/h" + std::to_string(number)) {
    for (const char* name : {"/run", "/config", "/state"})
      std::filesystem::create_directories(folder_ + name);
    std::ofstream(folder_ + "/sshd_config")
        << "Port 22\nListenAddress " << address() << "\nListenAddress " << address6()
        << "\nHostKey " << folder.path() << "/host_key\nAuthorizedKeysFile " << folder.path()
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
  /// Connections of ssh so far.
  int logins() const {
    const std::string text = says();
    int number = 0;
    for (std::size_t at = 0; (at = text.find("Accepted publickey", at)) != std::string::npos; ++at)
      ++number;
    return number;
  }
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
  /// Nodes that are seen there.
  std::vector<v1::NodeInfo> nodes(const std::string& graph) const {
    setenv("XDG_RUNTIME_DIR", (folder_ + "/run").c_str(), 1);
    return runtime::GraphView(graph).nodes();
  }
  /// Start of each one that is ready, by name.
  std::map<std::string, std::uint64_t> sees(const std::string& graph) const {
    std::map<std::string, std::uint64_t> seen;
    for (const v1::NodeInfo& node : nodes(graph)) {
      if (node.ready() && !node.name().starts_with("tap-")) seen[node.name()] = node.start_id();
    }
    return seen;
  }
  pid_t pid_of(const std::string& graph, const std::string& name) const {
    for (const v1::NodeInfo& node : nodes(graph)) {
      if (node.name() == name) return static_cast<pid_t>(node.pid());
    }
    return 1 << 30;  // of no process
  }

 private:
  std::string folder_;
  std::unique_ptr<Process> sshd_;
};

/// The real launcher, sshd and nodes on hosts of their own: network namespaces joined by wires.
class LaunchHosts : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string why = NetHost::missing();
    if (access("/usr/sbin/sshd", X_OK) != 0) why = "no /usr/sbin/sshd here";
    if (!why.empty()) GTEST_SKIP() << why;
  }
  /// `number` hosts, each wired to each; with `keys` they trust each other. `here`: the one whose
  /// network is that of this process.
  void begin(int number, bool keys = true, int here = 0) {
    mkdir("/run/sshd", 0755);
    for (const char* key : {"/host_key", "/user_key"}) {
      ASSERT_EQ(
          run("/usr/bin/ssh-keygen", {"-q", "-t", "ed25519", "-N", "", "-f", folder_.path() + key}),
          0);
    }
    std::string known = folder_.read("host_key.pub");
    folder_.write("known_hosts", "10.97.0.*,fd97::* " + known);
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
      hosts_.push_back(std::make_unique<SshHost>(folder_, n, n != here));
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
    launch_ = at(1).mimesis(
        "launch " + write_graph(nodes, more, top, first) + " --json --graph " + graph_, path());
  }
  std::string write_graph(const std::string& nodes, const std::string& more = "",
                          const std::string& top = "", std::size_t first = 1) {
    std::string text = "version: 1\n" + top + "hosts:\n";
    for (std::size_t n = first; n <= hosts_.size(); ++n) {
      const NetHost& host = *hosts_[n - 1];
      text += "  h" + std::to_string(n) + ": {address: \"" +
              (ipv6_ ? host.address6() : host.address()) +
              "\", user: root, prefix: " MIMESIS_BIN_DIR "/.." + more + "}\n";
    }
    return folder_.write("g.yaml", text + "nodes:\n" + nodes);
  }
  /// With the ssh of the test in front.
  std::string path() const { return "export PATH=" + folder_.path() + "/bin:$PATH; "; }
  double seconds_until(const std::function<bool()>& done, Clock::duration most = 20s) {
    const auto begin = Clock::now();
    return until(done, most) ? std::chrono::duration<double>(Clock::now() - begin).count() : -1.0;
  }
  bool until(const std::function<bool()>& done, Clock::duration most = 20s) {
    MachineTime time;
    while (!done()) {
      if (time.passed() > most) return false;
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
    return seconds_until([&] { return processes_with(graph_).empty(); });
  }
  static std::string counter(const std::string& name, const std::string& more = "") {
    return "  " + name + ": {exec: " MIMESIS_COUNTER + more + "}\n";
  }

  TemporaryFolder folder_;
  const std::string graph_ = "hosts-" + std::to_string(getpid());
  bool ipv6_ = false;  ///< addresses of the launch file
  std::vector<std::unique_ptr<SshHost>> hosts_;
  std::unique_ptr<Process> launch_;
};

}  // namespace mimesis::launch
