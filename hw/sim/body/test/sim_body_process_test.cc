// The real bridge and the real body as processes on the wall clock.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <csignal>

#include "common/testing/bad_settings.h"
#include "common/testing/process.h"
#include "hw/sim/body/body_params.h"
#include "hw/sim/body/test/bodies.h"
#include "proto/bridge.pb.h"
#include "proto/walker.pb.h"

namespace mimesis::hw::sim {
namespace {

using testing::Process;
using testing::TestGraph;
using testing::TestNode;
using namespace std::chrono_literals;

/// Uphill ahead, the furniture stands that much higher.
TEST(SimBodyParams, TheDrawerStandsOnTheSlope) {
  SimBodyParams params;
  params.slope_forward_rad = 0.05;
  params.drawer.present = true;
  params.drawer.drawer = {.front_x_m = 2.0, .handle_height_m = 0.9, .object_height_m = 1.0};
  const BodyOptions options = body_options(params, test_robot().biped);
  ASSERT_TRUE(options.drawer);
  EXPECT_NEAR(options.drawer->handle_height_m, 0.9 + 2.0 * std::tan(0.05), 1e-3);
  EXPECT_NEAR(options.drawer->object_height_m, 1.0 + 2.0 * std::tan(0.05), 1e-3);
}

class RobotProcess : public ::testing::Test {
 protected:
  RobotProcess() {
    peer.open();
    body.emplace(graph, "mimesis_sim_body", buses());
    ready = body->wait_ready(graph, "sim_body", 60s);
  }
  static std::vector<std::string> buses() {
    return {"--set",
            "buses=[{can: embedded:left_leg, joints: 6}, {can: embedded:right_leg, joints: 6}, "
            "{can: embedded:left_arm, joints: 9}, {can: embedded:right_arm, joints: 9}]"};
  }
  void start_bridge() {
    std::vector<std::string> arguments = buses();
    // Patience beyond the defaults: a busy machine must not stop the robot in a test about
    // something else.
    for (const std::string set : {"robot=biped.yaml", "hand=", "enable=auto", "silence_s=0.5",
                                  "feedback_timeout_s=0.5", "start_tolerance_rad=0.05"}) {
      arguments.insert(arguments.end(), {"--set", set});
    }
    arguments.insert(arguments.end(), {"--in", "command=test/command"});
    bridge.emplace(graph, "mimesis_bridge", arguments);
    ASSERT_TRUE(bridge->wait_ready(graph, "bridge")) << bridge->errors();
    ASSERT_TRUE(peer.wait_subscriber(command));
    ASSERT_TRUE(peer.until([&] { return arm.get() != nullptr && known("idle", "holding"); }, 30s))
        << bridge->errors();
    posture.assign(arm.get()->position_rad().begin(), arm.get()->position_rad().end());
  }
  bool known(const std::string& state, const std::string& other) {
    const v1::BridgeStatus* s = status.get();
    return s != nullptr && (s->state() == state || s->state() == other);
  }
  template <class Done>
  bool stream(Done done) {
    runtime::Time next{};
    return peer.until(
        [&] {
          if (const auto now = TestNode::now(); now >= next) {
            v1::JointCommand c;
            for (const double q : posture) c.add_position_rad(q);
            command.send(c, now);
            next = now + 5ms;
          }
          return done();
        },
        30s);
  }
  void follow() {
    ASSERT_TRUE(stream([&] { return known("following", "following"); })) << bridge->errors();
  }
  int drives_in(v1::DriveState state) {
    const v1::JointState* t = drives.get();
    return t == nullptr ? 0 : static_cast<int>(std::ranges::count(t->drives(), int{state}));
  }
  /// `duration` of the simulation's time from now on.
  runtime::Time after(runtime::Time duration) {
    peer.until([&] { return truth.get() != nullptr; });
    return truth.stamp() + duration;
  }

  TestGraph graph;
  TestNode peer{graph,
                {{"truth", "sim_body/truth"},
                 {"drives", "sim_body/joint_states"},
                 {"joint_states", "bridge/joint_states"},
                 {"status", "bridge/status"}},
                {{"command", "test/command"}}};
  runtime::Latest<v1::BodyTruth> truth{peer.bus(), "truth"};
  runtime::Latest<v1::JointState> drives{peer.bus(), "drives"}, arm{peer.bus(), "joint_states"};
  runtime::Latest<v1::BridgeStatus> status{peer.bus(), "status"};
  runtime::Out<v1::JointCommand> command{peer.bus(), "command"};
  std::optional<Process> body, bridge;
  bool ready = false;
  std::vector<double> posture;
};

TEST_F(RobotProcess, StandsWhateverHappensToTheBridge) {
  ASSERT_TRUE(ready) << body->errors();
  start_bridge();
  follow();
  ASSERT_TRUE(stream([&] { return drives_in(v1::DRIVE_STATE_OPERATION_ENABLED) == 30; }));
  const runtime::Time half_a_second = after(500ms);
  ASSERT_TRUE(stream([&] { return truth.stamp() > half_a_second; }));
  EXPECT_NEAR(truth.get()->normal_n(0) + truth.get()->normal_n(1), 58.0 * 9.81, 5.7);

  // The walker dies: the joints are held, powered, until a new stream.
  ASSERT_TRUE(peer.until([&] { return status.get()->reason() == "no command for 0.5 s: holding"; }))
      << bridge->errors();
  EXPECT_EQ(drives_in(v1::DRIVE_STATE_OPERATION_ENABLED), 30);
  posture.assign(arm.get()->position_rad().begin(), arm.get()->position_rad().end());
  follow();

  // The bridge dies: the drives stop by themselves and stay powered.
  bridge->signal(SIGKILL);
  EXPECT_EQ(bridge->wait(), 128 + SIGKILL);
  ASSERT_TRUE(peer.until([&] { return drives_in(v1::DRIVE_STATE_QUICK_STOP_ACTIVE) == 30; }));
  const runtime::Time a_second = after(1s);
  ASSERT_TRUE(peer.until([&] { return truth.stamp() > a_second; }));
  EXPECT_FALSE(truth.get()->fell()) << truth.get()->how();

  // A new one takes over without a moment of no power, and ends in a quick stop.
  start_bridge();
  ASSERT_TRUE(peer.until([&] { return known("holding", "holding"); }));
  follow();
  EXPECT_EQ(bridge->terminate(), 0) << bridge->errors();
  ASSERT_TRUE(peer.until([&] { return drives_in(v1::DRIVE_STATE_QUICK_STOP_ACTIVE) == 30; }));
  EXPECT_FALSE(truth.get()->fell()) << truth.get()->how();
  EXPECT_EQ(body->terminate(), 0) << body->errors();
}

TEST(SimBodyProcess, RefusesBadConfigurationInOneLine) {
  using testing::refuses;
  refuses("mimesis_sim_body", {"robot=nobody.yaml"}, "nobody.yaml");
  refuses("mimesis_sim_body", {"rate_hz=100"}, "sim_body.rate_hz: 100 contradicts");
  refuses("mimesis_sim_body", {"plant=jelly"}, "plant");
  refuses("mimesis_sim_body", {"can=can0"}, "expected embedded:NAME");
}

}  // namespace
}  // namespace mimesis::hw::sim
