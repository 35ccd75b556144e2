// The real process, with an agent that lives in another one: killed, late, and back.
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

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
          while (const auto s = states_in.pop()) step = s->header().seq(), agents = s->id_size();
          return status.externals_size() == 1 && status.externals(0).trust() == wanted;
        },
        30s);
  }
  bool until_step(std::uint64_t wanted) {
    return peer.until(
        [&] {
          while (const auto s = states_in.pop()) step = s->header().seq(), agents = s->id_size();
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

TEST(CrowdProcess, TrustsALateAgentNoMoreUntilItIsBackAndGoesOnWithoutOneThatIsKilled) {
  const testing::ScenarioFile file(kGuest);
  TestGraph graph;
  AgentProcess agent(graph);
  Process node(graph, kCrowd, options(file));
  Listener crowd(graph);
  ASSERT_TRUE(crowd.until_trust(v1::CROWD_TRUST_TRUSTED)) << node.errors();
  ASSERT_TRUE(crowd.until_step(crowd.step + 20));
  EXPECT_EQ(crowd.agents, 5);
  agent.signal(SIGSTOP);
  ASSERT_TRUE(crowd.until_trust(v1::CROWD_TRUST_LAGGING)) << node.errors();
  agent.signal(SIGCONT);
  ASSERT_TRUE(crowd.until_trust(v1::CROWD_TRUST_TRUSTED)) << node.errors();
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
  refused("set=groups.0.rules.phase.gain_1_s=-1", "groups.0.rules.phase.gain_1_s");
  refused("set=groups.0.count=-1", "groups.0.count");
  refused("set=gaits.0.mean_m_rad=0.01", "gaits.0.mean_m_rad");
  refused("set=groups.0.colour=red", "colour");
  refused("trust.forget_s=0.1", "crowd.trust.forget_s");
}

}  // namespace
}  // namespace mimesis::crowd
