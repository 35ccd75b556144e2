// The real process, with an agent that lives in another one: killed, late, and back; two of them on
// hosts of their own.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <map>

#include "common/testing/process.h"
#include "nodes/crowd/test/guests.h"
#include "nodes/crowd/test/scenario_file.h"
#include "proto/crowd.pb.h"

namespace mimesis::crowd {
namespace {

using namespace std::chrono_literals;
using mimesis::testing::Process;
using mimesis::testing::TestGraph;
using mimesis::testing::TestNode;

constexpr const char* kCrowd = MIMESIS_BIN_DIR "/mimesis_crowd";
const std::string kGuest = testing::square_with_robot("guest", "0.5");

/// A process that walks beside the crowd and reports every 20 ms.
class AgentProcess {
 public:
  explicit AgentProcess(const TestGraph& graph) : pid_(fork()) {
    if (pid_ != 0) return;
    try {
      walk(graph);
    } catch (...) {
    }
    _exit(1);
  }
  ~AgentProcess() {
    signal(SIGKILL);
    waitpid(pid_, nullptr, 0);
  }
  AgentProcess(const AgentProcess&) = delete;
  AgentProcess& operator=(const AgentProcess&) = delete;
  void signal(int number) const { kill(pid_, number); }

 private:
  static void walk(const TestGraph& graph) {
    TestNode self(graph, {}, {{"agents", "test/agents"}}, "robot");
    runtime::Out<v1::CrowdStates> out(self.bus(), "agents");
    self.open();
    const runtime::Time start = TestNode::now();
    runtime::Time due = start;
    self.until(
        [&] {
          const runtime::Time now = TestNode::now();
          if (now < due) return false;
          due = now + 20ms;
          const double t = std::chrono::duration<double>(now - start).count();
          v1::CrowdStates s = testing::robot_beside(t, 0.0);
          out.send(s, now);
          return false;
        },
        120s);
  }
  pid_t pid_;
};

/// Messages of the crowd.
struct Listener {
  explicit Listener(const TestGraph& graph)
      : peer(graph,
             {{"status", "crowd/status"},
              {"certificate", "crowd/certificate"},
              {"states", "crowd/states"}},
             {}),
        status_in(peer.bus(), "status"),
        certificate_in(peer.bus(), "certificate"),
        states_in(peer.bus(), "states") {
    peer.open();
  }
  bool until_trust(v1::CrowdTrust wanted) {
    return peer.until(
        [&] {
          while (const auto s = status_in.pop()) status = *s;
          while (const auto c = certificate_in.pop()) {
            certificate = *c;
            if (!c->voided().empty()) voided = c->voided();
          }
          while (const auto s = states_in.pop()) step = s->step(), agents = s->id_size();
          return status.externals_size() == 1 && status.externals(0).trust() == wanted;
        },
        30s);
  }
  bool until_step(std::uint64_t wanted) {
    return peer.until(
        [&] {
          while (const auto s = states_in.pop()) step = s->step(), agents = s->id_size();
          return step >= wanted;
        },
        30s);
  }

  TestNode peer;
  runtime::Reliable<v1::CrowdStatus> status_in;
  runtime::Reliable<v1::CrowdCertificate> certificate_in;
  runtime::Reliable<v1::CrowdStates> states_in;
  v1::CrowdStatus status;
  v1::CrowdCertificate certificate;
  std::string voided;
  std::uint64_t step = 0;
  int agents = 0;
};

std::vector<std::string> options(const testing::ScenarioFile& file) {
  return {"--set", "scenario=" + file.path(), "--in", "agents=test/agents"};
}

TEST(CrowdProcess, GoesOnWhenAnAgentsProcessIsKilled) {
  const testing::ScenarioFile file(kGuest);
  TestGraph graph;
  AgentProcess agent(graph);
  Process node(graph, kCrowd, options(file));
  Listener crowd(graph);
  ASSERT_TRUE(crowd.until_trust(v1::CROWD_TRUST_TRUSTED)) << node.errors();
  ASSERT_TRUE(crowd.until_step(crowd.step + 20));
  EXPECT_EQ(crowd.agents, 5);
  agent.signal(SIGKILL);
  ASSERT_TRUE(crowd.until_trust(v1::CROWD_TRUST_LAGGING)) << node.errors();
  EXPECT_NE(crowd.status.externals(0).reason().find("its last state is"), std::string::npos);
  ASSERT_TRUE(crowd.until_trust(v1::CROWD_TRUST_ABSENT)) << node.errors();
  EXPECT_NE(crowd.voided.find("4 agents instead of 5: 'robot' its last state is"),
            std::string::npos)
      << crowd.voided;
  ASSERT_TRUE(crowd.until_step(crowd.step + 20));
  EXPECT_EQ(crowd.agents, 4);
  EXPECT_EQ(crowd.certificate.guarantees(0).agents(), 4u);
  EXPECT_EQ(node.terminate(), 0) << node.errors();
}

TEST(CrowdProcess, TrustsALateAgentNoMoreUntilItIsBack) {
  const testing::ScenarioFile file(kGuest);
  TestGraph graph;
  AgentProcess agent(graph);
  Process node(graph, kCrowd, options(file));
  Listener crowd(graph);
  ASSERT_TRUE(crowd.until_trust(v1::CROWD_TRUST_TRUSTED)) << node.errors();
  agent.signal(SIGSTOP);
  ASSERT_TRUE(crowd.until_trust(v1::CROWD_TRUST_LAGGING)) << node.errors();
  agent.signal(SIGCONT);
  ASSERT_TRUE(crowd.until_trust(v1::CROWD_TRUST_TRUSTED)) << node.errors();
  EXPECT_EQ(node.terminate(), 0) << node.errors();
  EXPECT_NE(node.errors().find("agent 'robot' is not trusted"), std::string::npos);
}

TEST(CrowdProcess, BadConfigurationExitsWith2AndSaysWhere) {
  const testing::ScenarioFile file(kGuest);
  const auto refused = [&](const std::string& setting, const std::string& what) {
    TestGraph graph;
    std::vector<std::string> all = options(file);
    all.insert(all.end(), {"--set", setting});
    Process node(graph, kCrowd, all);
    EXPECT_EQ(node.wait(), 2) << setting;
    EXPECT_NE(node.errors().find(what), std::string::npos) << node.errors();
  };
  refused("rate_hz=0", "crowd.rate_hz");
  refused("scenario=nowhere", "nowhere");
  refused("regions.own=3", "crowd.regions.own");
  refused("regions.x_m=[2, 1]", "regions.x_m");
  refused("set=groups.0.rules.phase.gain_1_s=-1", "groups.0.rules.phase.gain_1_s");
  refused("set=groups.0.count=-1", "groups.0.count");
  refused("set=gaits.0.mean_m_rad=0.01", "gaits.0.mean_m_rad");
  refused("set=groups.0.colour=red", "colour");
  refused("trust.forget_s=0.1", "crowd.trust.forget_s");
}

/// A coordinator in a network namespace of its own, which knows the other one by tcp alone, and
/// what it publishes.
struct Host {
  Host(const testing::ScenarioFile& file, int number)
      : process("/usr/bin/unshare", command(file, number)),
        peer(graph, {{"status", name(number) + "/status"}, {"states", "crowd/states"}}, {},
             "watcher"),
        status_in(peer.bus(), "status"),
        states_in(peer.bus(), "states"),
        own(static_cast<std::uint32_t>(number)) {
    peer.open();
  }
  static std::string name(int number) { return "crowd" + std::to_string(number); }
  static std::string address(int number) { return "10.97.0." + std::to_string(number); }
  std::vector<std::string> command(const testing::ScenarioFile& file, int number) const {
    const std::string here = address(number), there = address(3 - number);
    const std::string program = std::string(kCrowd) + " --graph " + graph.name() + " --name " +
                                name(number) + " --bind tcp://" + here + ":7310 --peer tcp://" +
                                there + ":7310 --set scenario=" + file.path() +
                                " --set regions.own=" + std::to_string(number) +
                                " --set regions.x_m=[0] --in peers=crowd/states"
                                " --in handovers=crowd/handover --out states=crowd/states"
                                " --out handover=crowd/handover";
    return {"-n", "sh", "-c",
            "until ip link set eth up 2>/dev/null; do sleep 0.02; done; ip addr add " + here +
                "/24 dev eth; exec " + program};
  }
  /// Sets the link up or down.
  void link(const std::string& state) const {
    Process set("/usr/bin/nsenter",
                {"-t", std::to_string(process.pid()), "-n", "ip", "link", "set", "eth", state});
    EXPECT_EQ(set.wait(), 0) << set.errors();
  }

  TestGraph graph;
  Process process;
  TestNode peer;
  runtime::Reliable<v1::CrowdStatus> status_in;
  runtime::Reliable<v1::CrowdStates> states_in;
  std::uint32_t own;
  v1::CrowdStatus status;
  v1::CrowdStates states;
};

TEST(CrowdProcess, TwoHostsHandOverByTcpAndACutBetweenThemDoublesNobody) {
  if (geteuid() != 0 || Process("/usr/bin/unshare", {"-n", "ip", "link"}).wait() != 0) {
    GTEST_SKIP() << "no network namespaces here";
  }
  const testing::ScenarioFile file(testing::kFormation);
  Host one(file, 1), two(file, 2);
  const auto netns = [](pid_t pid) {
    std::error_code gone;
    return std::filesystem::read_symlink("/proc/" + std::to_string(pid) + "/ns/net", gone).string();
  };
  for (const Host* host : {&one, &two}) {
    one.peer.until([&] { return netns(host->process.pid()) != netns(getpid()); });
  }
  Process wire("/usr/sbin/ip",
               {"link", "add", "eth", "netns", std::to_string(one.process.pid()), "type", "veth",
                "peer", "name", "eth", "netns", std::to_string(two.process.pid())});
  if (wire.wait() != 0) GTEST_SKIP() << "no virtual network here: " << wire.errors();

  std::map<std::uint64_t, std::pair<std::uint32_t, std::uint64_t>> moved;  // by whom, last
  int twice = 0;
  std::multimap<std::uint64_t, std::pair<std::uint32_t, std::vector<std::uint64_t>>> steps;
  const auto drain = [&](Host& host) {
    host.peer.until([] { return false; }, 5ms);
    while (const auto status = host.status_in.pop()) host.status = *status;
    while (const auto states = host.states_in.pop()) {
      host.states = *states;
      if (!host.status.runs()) continue;
      steps.insert(
          {states->header().stamp_ns(), {host.own, {states->id().begin(), states->id().end()}}});
    }
  };
  const auto until = [&](int agents_of_one, int agents_of_two) {
    const runtime::Time end = TestNode::now() + 30s;
    while (TestNode::now() < end) {
      drain(one);
      drain(two);
      const bool run = one.status.runs() && two.status.runs();
      if (run && one.states.id_size() == agents_of_one && two.states.id_size() == agents_of_two) {
        return true;
      }
    }
    return false;
  };
  const auto said = [&] {
    return std::to_string(one.states.id_size()) + " and " + std::to_string(two.states.id_size()) +
           " agents\n" + one.process.errors() + two.process.errors();
  };
  ASSERT_TRUE(until(0, 16)) << "all walk over the cut: " << said();
  EXPECT_GE(one.status.given(), 4u);
  one.link("down");
  ASSERT_TRUE(until(16, 0)) << "only the half with number 1 goes on: " << said();
  one.link("up");
  ASSERT_TRUE(until(0, 16)) << "it gives them back: " << said();
  // Who reports an agent has moved it in that step, and moves it on until the next one.
  for (const auto& [stamp, step] : steps) {
    for (const std::uint64_t id : step.second) {
      auto& [by, last] = moved[id];
      if (by != 0 && by != step.first && stamp < last + 20'000'000) ++twice;
      by = step.first, last = stamp;
    }
  }
  EXPECT_EQ(moved.size(), 16u);
  EXPECT_EQ(twice, 0);
  EXPECT_EQ(one.process.terminate(), 0) << one.process.errors();
  EXPECT_EQ(two.process.terminate(), 0) << two.process.errors();
}

}  // namespace
}  // namespace mimesis::crowd
