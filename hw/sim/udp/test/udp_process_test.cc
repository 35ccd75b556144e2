// Bridge and simulated controller as processes, over UDP on the wall clock.
#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "common/testing/process.h"
#include "proto/bridge.pb.h"

namespace mimesis::hw::sim {
namespace {

using namespace std::chrono_literals;
using testing::Process;
using testing::TestGraph;
using testing::TestNode;

class ArmOverUdp : public ::testing::Test {
 protected:
  ArmOverUdp() {
    std::ifstream in(std::string(MIMESIS_SOURCE_DIR) + "/models/lwr4.yaml");
    std::ofstream out(robot);
    for (std::string line; std::getline(in, line);)
      out << (line.starts_with("drives:") ? "drives: udp" : line) << '\n';
    out.close();
    peer.open();
    plug();
    bridge.emplace(graph, "mimesis_bridge",
                   std::vector<std::string>{
                       "--set", "robot=" + robot, "--set", "controller=" + address, "--set",
                       "hand=", "--set", "enable=auto", "--set", "silence_s=0.5", "--set",
                       "feedback_timeout_s=0.5", "--in", "command=test/command"});
    EXPECT_TRUE(bridge->wait_ready(graph, "bridge", 60s)) << bridge->errors();
    EXPECT_TRUE(peer.wait_subscriber(command));
    EXPECT_TRUE(peer.until([&] { return truth.get() != nullptr; }));
    posture.assign(truth.get()->position_rad().begin(), truth.get()->position_rad().end());
  }
  void plug() {
    arm.emplace(graph, "mimesis_sim_udp",
                std::vector<std::string>{"--set", "robot=" + robot, "--set", "address=" + address});
    EXPECT_TRUE(arm->wait_ready(graph, "sim_udp", 60s)) << arm->errors();
  }
  /// Streams the posture until `done`.
  template <class Done>
  bool stream(Done done) {
    runtime::Time next = peer.graph_time();
    return peer.until([&] {
      if (const runtime::Time now = peer.graph_time(); now >= next) {
        v1::JointCommand c;
        for (const double q : posture) c.add_position_rad(q);
        command.send(c, now);
        next = now + 5ms;
        if (moves) posture[3] += 0.001;
      }
      return done();
    });
  }
  std::string state() { return status.get() == nullptr ? "" : status.get()->state(); }

  TestGraph graph;
  const std::string robot = graph.directory() + "/arm.yaml";
  const std::string address = "127.0.0.1:" + std::to_string(20'000 + getpid() % 7'000);
  TestNode peer{graph,
                {{"truth", "sim_udp/joint_states"}, {"status", "bridge/status"}},
                {{"command", "test/command"}},
                "test",
                runtime::ClockKind::wall};
  runtime::Latest<v1::JointState> truth{peer.bus(), "truth"};
  runtime::Latest<v1::BridgeStatus> status{peer.bus(), "status"};
  runtime::Out<v1::JointCommand> command{peer.bus(), "command"};
  std::optional<Process> arm, bridge;
  std::vector<double> posture;
  bool moves = false;
};

TEST_F(ArmOverUdp, FollowsStopsAndComesBack) {
  ASSERT_TRUE(stream([&] { return state() == "following"; })) << bridge->errors();
  moves = true;
  ASSERT_TRUE(stream([&] { return truth.get()->position_rad(3) > 1.7; })) << bridge->errors();
  arm->signal(SIGKILL);
  moves = false;
  ASSERT_TRUE(stream([&] { return state() == "fault"; })) << bridge->errors();
  EXPECT_EQ(status.get()->reason(), "controller " + address + ": no state for 0.5 s");
  plug();
  const runtime::Time silent_from = peer.graph_time();  // a new stream comes after a pause
  ASSERT_TRUE(peer.until([&] {
    return state() == "idle" && peer.graph_time() > silent_from + 600ms;
  })) << bridge->errors();
  posture.assign(truth.get()->position_rad().begin(), truth.get()->position_rad().end());
  EXPECT_TRUE(stream([&] { return truth.get()->operational(); })) << bridge->errors();
}

TEST_F(ArmOverUdp, StopsWhenTheBridgeIsKilled) {
  moves = true;
  ASSERT_TRUE(stream([&] { return truth.get()->position_rad(3) > 1.65; })) << bridge->errors();
  bridge->signal(SIGKILL);
  EXPECT_TRUE(peer.until([&] { return !truth.get()->operational(); })) << arm->errors();
}

}  // namespace
}  // namespace mimesis::hw::sim
