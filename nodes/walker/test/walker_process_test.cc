#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "common/model/files.h"
#include "common/testing/bad_settings.h"
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

/// The rest of the graph on the wall clock: an ideal robot, and a sender of wishes.
struct Rest {
  explicit Rest(const TestGraph& graph)
      : biped(model::load_biped("biped.yaml")),
        robot(biped),
        peer(graph,
             {{"command", "walker/command"},
              {"feedback", "walker/feedback"},
              {"balance", "walker/balance"}},
             {{"sensors", "test/sensors"},
              {"joint_states", "test/joint_states"},
              {"motion", "test/motion"}}),
        command(peer.bus(), "command"),
        feedback(peer.bus(), "feedback"),
        balance(peer.bus(), "balance"),
        sensors(peer.bus(), "sensors"),
        joints(peer.bus(), "joint_states"),
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
  v1::JointState encoders;
  TestNode peer;
  runtime::Reliable<v1::JointCommand> command;
  runtime::Reliable<v1::WalkFeedback> feedback;
  runtime::Reliable<v1::WalkBalance> balance;
  runtime::Out<v1::BodySensors> sensors;
  runtime::Out<v1::JointState> joints;
  runtime::Out<v1::Motion> motion;
};

// The machine may be busy: delays are not tested here.
std::vector<std::string> options() {
  return {"--in",  "sensors=test/sensors", "--in",  "joint_states=test/joint_states",
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
    mimesis::testing::refuses(kWalker, {setting}, what);
  };
  refused("rate_hz=100", "walker.rate_hz");
  refused("pattern=herdt", "walker.pattern");
  refused("robot=nowhere.yaml", "nowhere.yaml");
  refused("filter_iterations=0", "walker.filter_iterations");
  refused("stabilizer.kd_1_s=-1", "walker.stabilizer.kd_1_s");
  refused("gait.double_support_s=0.6", "walker.gait.double_support_s");
  refused("colour=red", "colour");
}

/// models/biped.yaml and its URDF in a folder of their own, `what` in the URDF replaced.
class DamagedRobot {
 public:
  DamagedRobot(const TestGraph& graph, const std::string& what, const std::string& by)
      : folder_(graph.directory() + "/damaged") {
    const std::filesystem::path models = MIMESIS_SOURCE_DIR "/models";
    std::filesystem::create_directories(folder_);
    std::filesystem::copy_file(models / "biped.yaml", folder_ / "biped.yaml");
    std::ifstream in(models / "biped.urdf");
    std::string urdf{std::istreambuf_iterator<char>(in), {}};
    const auto at = urdf.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    if (at != std::string::npos) urdf.replace(at, what.size(), by);
    std::ofstream(folder_ / "biped.urdf") << urdf;
  }
  std::string setting() const { return "robot=" + (folder_ / "biped.yaml").string(); }

 private:
  std::filesystem::path folder_;
};

TEST(WalkerProcess, ARobotWithoutOneOfItsJointsIsRefusedInOneLine) {
  const auto refused = [](const std::string& urdf, const std::string& by, const std::string& name) {
    TestGraph graph;
    const DamagedRobot robot(graph, urdf, by);
    Process node(graph, kWalker, {"--set", robot.setting()});
    EXPECT_EQ(node.wait(), 2) << node.errors();
    EXPECT_NE(node.errors().find(name), std::string::npos) << node.errors();
    EXPECT_EQ(std::ranges::count(node.errors(), '\n'), 1) << node.errors();
  };
  refused("joint name=\"left_knee\"", "joint name=\"knee\"", "left_knee");
  refused("name=\"right_ankle_roll\" type=\"revolute\"", "name=\"right_ankle_roll\" type=\"fixed\"",
          "right");
  refused("joint name=\"left_elbow\"", "joint name=\"elbow\"", "left_elbow");
  refused("link name=\"chest\"", "link name=\"breast\"", "chest");
}

TEST(WalkerProcess, AStackOfTasksFromAFileMovesTheRobot) {
  TestGraph graph;
  Rest rest(graph);
  std::vector<std::string> arguments = options();
  arguments.insert(arguments.end(),
                   {"--set",
                    "stack.tasks=[{name: left, kind: foot, link: left_sole, weight: 100, gain_1_s: "
                    "200}, {name: right, kind: foot, link: right_sole, weight: 100, gain_1_s: "
                    "200}, {name: com, kind: com, weight: 10, gain_1_s: 200}, {name: chest, kind: "
                    "orientation, link: chest, priority: 2}, {name: arms, kind: posture, priority: "
                    "3, joints: [left_elbow, right_elbow]}]"});
  Process node(graph, kWalker, arguments);
  ASSERT_TRUE(rest.peer.wait_subscriber(rest.sensors)) << node.errors();
  EXPECT_TRUE(rest.until(v1::WALK_STATE_STANDING)) << node.errors();
  rest.forward_m_s = 0.2;
  EXPECT_TRUE(rest.until(v1::WALK_STATE_WALKING, 2)) << node.errors();
  EXPECT_EQ(node.terminate(), 0) << node.errors();
}

TEST(WalkerProcess, AStackOfTasksThatDoesNotFitTheRobotIsRefused) {
  const auto refused = [](const std::string& tasks, const std::string& what) {
    mimesis::testing::refuses(kWalker, {"stack.tasks=" + tasks}, what);
  };
  refused("[{name: tail, kind: orientation, link: tail}]", "has no link 'tail'");
  refused("[{name: arm, kind: posture, joints: [wing]}]", "has no joint 'wing'");
  refused("[{name: arm, kind: swim}]", "kind");
}

}  // namespace
}  // namespace mimesis::walker
