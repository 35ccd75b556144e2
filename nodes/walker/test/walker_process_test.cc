#include <gtest/gtest.h>

#include "common/model/files.h"
#include "common/testing/process.h"
#include "nodes/walker/test/perfect_robot.h"
#include "proto/motion.pb.h"

namespace mimesis::walker {
namespace {

using namespace std::chrono_literals;
using mimesis::testing::Process;
using mimesis::testing::TestGraph;
using mimesis::testing::TestNode;

constexpr const char* kWalker = MIMESIS_BIN_DIR "/mimesis_walker";

/// The rest of the graph on the wall clock: a robot that does as told, and who wishes.
struct Rest {
  explicit Rest(const TestGraph& graph)
      : biped(model::load_biped("biped.yaml")),
        robot(biped),
        peer(graph,
             {{"command", "walker/command"},
              {"feedback", "walker/feedback"},
              {"balance", "walker/balance"}},
             {{"sensors", "test/sensors"}, {"joints", "test/joints"}, {"motion", "test/motion"}}),
        command(peer.bus(), "command"),
        feedback(peer.bus(), "feedback"),
        balance(peer.bus(), "balance"),
        sensors(peer.bus(), "sensors"),
        joints(peer.bus(), "joints"),
        motion(peer.bus(), "motion") {
    peer.open();
  }

  /// Plays the robot until the walker is in `state` with at least `steps` behind it.
  bool until(v1::WalkState state, std::uint32_t steps = 0) {
    return peer.until(
        [&] {
          while (const auto c = command.pop()) robot.obey(*c);
          while (const auto b = balance.pop()) robot.stand(*b);
          while (const auto f = feedback.pop()) last = *f;
          if (last.feet_size() == 2) robot.stand(last);
          sensors.send(now = robot.sensors(), TestNode::now());
          joints.send(encoders = robot.joints(), TestNode::now());
          if (forward_m_s != 0.0) {
            v1::Motion wish;
            wish.set_smooth_velocity_forward_m_s(forward_m_s);
            motion.send(wish, TestNode::now());
          }
          return last.state() == state && last.steps() >= steps;
        },
        30s);
  }

  robot::Biped biped;
  testing::PerfectRobot robot;
  double forward_m_s = 0.0;
  v1::WalkFeedback last;
  v1::BodySensors now;
  v1::ArmState encoders;
  TestNode peer;
  runtime::Reliable<v1::JointCommand> command;
  runtime::Reliable<v1::WalkFeedback> feedback;
  runtime::Reliable<v1::WalkBalance> balance;
  runtime::Out<v1::BodySensors> sensors;
  runtime::Out<v1::ArmState> joints;
  runtime::Out<v1::Motion> motion;
};

// The machine may be busy: what is late is not what is tested here.
std::vector<std::string> options() {
  return {"--in",  "sensors=test/sensors", "--in",  "joints=test/joints",
          "--in",  "motion=test/motion",   "--set", "sensors_stale_s=1",
          "--set", "motion_stale_s=0.5",   "--set", "stabilize=false",
          "--set", "ready.approach_s=0.2"};
}

TEST(WalkerProcess, StandsWalksAndStops) {
  TestGraph graph;
  Rest rest(graph);
  Process node(graph, kWalker, options());
  ASSERT_TRUE(rest.peer.wait_subscriber(rest.sensors)) << node.errors();
  EXPECT_TRUE(rest.until(v1::WALK_STATE_STANDING)) << node.errors();
  rest.forward_m_s = 0.2;
  EXPECT_TRUE(rest.until(v1::WALK_STATE_WALKING, 2)) << node.errors();
  rest.forward_m_s = 0.0;
  EXPECT_TRUE(rest.until(v1::WALK_STATE_STANDING, 2)) << node.errors();
  EXPECT_EQ(node.terminate(), 0) << node.errors();
  EXPECT_NE(node.errors().find("robot 'biped'"), std::string::npos) << node.errors();
}

TEST(WalkerProcess, BadConfigurationExitsWith2AndNamesTheKey) {
  const auto refused = [](const std::string& setting, const std::string& what) {
    TestGraph graph;
    Process node(graph, kWalker, {"--set", setting});
    EXPECT_EQ(node.wait(), 2) << setting;
    EXPECT_NE(node.errors().find(what), std::string::npos) << node.errors();
  };
  refused("rate_hz=100", "walker.rate_hz");
  refused("pattern=herdt", "walker.pattern");
  refused("robot=nowhere.yaml", "nowhere.yaml");
  refused("filter_iterations=0", "walker.filter_iterations");
  refused("stabilizer.kd_1_s=-1", "walker.stabilizer.kd_1_s");
  refused("gait.double_support_s=0.6", "walker.gait.double_support_s");
  refused("colour=red", "colour");
}

}  // namespace
}  // namespace mimesis::walker
