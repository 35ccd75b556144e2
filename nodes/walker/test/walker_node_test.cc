#include "nodes/walker/walker_node.h"

#include <gtest/gtest.h>

#include <cmath>
#include <deque>

#include "common/error.h"
#include "common/model/files.h"
#include "common/testing/loopback.h"
#include "nodes/walker/test/perfect_robot.h"

namespace mimesis::walker {
namespace {

using namespace std::chrono_literals;
using mimesis::testing::Loopback;
using runtime::Time;
using testing::PerfectRobot;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

const robot::Biped& biped() {
  static const robot::Biped b = model::load_biped("biped.yaml");
  return b;
}

WalkerParams params() {
  WalkerParams p;
  p.ready.approach_s = 0.2;
  return p;
}

/// One node, a robot that does as told, and what both said.
class Rig {
 public:
  explicit Rig(const WalkerParams& p = params()) : node(p, bus) {}

  void run(Time duration) {
    for (const Time end = now + duration; now < end; now += 5ms) {
      if (sends_body) bus.send("sensors", robot.sensors(), now);
      if (sends_joints) bus.send("joints", robot.joints(), now);
      if (motion) bus.send("motion", *motion, now);
      node.step(now);
      take();
    }
  }
  /// Until it stands on its own feet.
  void ready() {
    run(1s);
    ASSERT_EQ(state(), v1::WALK_STATE_STANDING) << status.reason();
  }
  void walk(double forward_m_s) {
    motion.emplace();
    motion->set_velocity_forward_m_s(forward_m_s);
    motion->set_smooth_velocity_forward_m_s(forward_m_s);
  }
  v1::WalkState state() const { return feedback.state(); }
  bool went_through(v1::WalkState wanted) const {
    return std::ranges::find(states, wanted) != states.end();
  }

  Loopback bus;
  PerfectRobot robot{biped()};
  WalkerNode node;
  Time now = 1s;
  bool sends_body = true, sends_joints = true;
  std::optional<v1::Motion> motion;
  std::optional<v1::JointCommand> command;  // of the last step
  v1::WalkFeedback feedback;
  v1::WalkBalance balance;
  v1::WalkerStatus status;
  std::deque<v1::WalkState> states;  // without repetitions
  double fastest_rad_s = 0.0;        // change of a set-point
  int statuses = 0;

 private:
  void take() {
    const std::optional<v1::JointCommand> last = command;
    command = bus.take<v1::JointCommand>("command");
    if (command) {
      for (int j = 0; last && j < command->position_rad_size(); ++j) {
        fastest_rad_s = std::max(
            fastest_rad_s, std::abs(command->position_rad(j) - last->position_rad(j)) / kTick_s);
      }
      robot.obey(*command);
    }
    if (auto f = bus.take<v1::WalkFeedback>("feedback")) {
      feedback = *f;
      robot.stand(feedback);
    }
    if (auto b = bus.take<v1::WalkBalance>("balance")) {
      balance = *b;
      robot.stand(balance);
    }
    while (auto s = bus.take<v1::WalkerStatus>("status")) {
      status = *s;
      ++statuses;
    }
    if (states.empty() || states.back() != feedback.state()) states.push_back(feedback.state());
  }
};

TEST(WalkerNode, WaitsForWhatItNeedsAndSaysFor) {
  Rig rig;
  rig.sends_body = rig.sends_joints = false;
  rig.run(100ms);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_WAITING);
  EXPECT_EQ(rig.status.reason(), "nothing heard of encoders");
  EXPECT_FALSE(rig.command.has_value());
  rig.sends_joints = true;
  rig.run(100ms);
  EXPECT_EQ(rig.status.reason(), "nothing heard of IMU and foot forces");
  rig.sends_body = true;
  rig.robot.load_share = 0.3;
  rig.run(100ms);
  EXPECT_EQ(rig.status.reason(), "the feet carry 171 N of 569 N: not on the ground");
  rig.robot.load_share = 1.0;
  rig.robot.tilt = Eigen::AngleAxisd(0.2, Eigen::Vector3d::UnitX());
  rig.run(100ms);
  EXPECT_EQ(rig.status.reason(), "the trunk is tilted by 0.20 rad, at most 0.15 to begin");
  rig.robot.tilt.setIdentity();
  rig.robot.q[biped().tree.require_joint("left_elbow")] -= 0.5;
  rig.run(100ms);
  EXPECT_EQ(rig.status.reason(), "left_elbow is 0.50 rad from half-sitting, at most 0.35 to begin");
  EXPECT_FALSE(rig.command.has_value());
}

TEST(WalkerNode, BeginsWhereTheRobotIsAndGoesSlowlyToHalfSitting) {
  Rig rig;
  rig.robot.operational = false;
  const int elbow = biped().tree.require_joint("left_elbow");
  rig.robot.q[elbow] += 0.3;
  const Eigen::VectorXd actual = rig.robot.q;
  rig.run(500ms);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_WAITING);
  EXPECT_EQ(rig.status.reason(), "the bridge does not follow yet");
  ASSERT_TRUE(rig.command.has_value());
  EXPECT_EQ(rig.command->position_rad(elbow), actual[elbow]);
  EXPECT_EQ(rig.fastest_rad_s, 0.0);
  rig.robot.operational = true;
  rig.run(3s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING);
  EXPECT_NEAR(rig.command->position_rad(elbow), biped().half_sitting[elbow], 0.01);
  EXPECT_LE(rig.fastest_rad_s, 1.05 * 0.1 * biped().tree.max_speed().maxCoeff());
}

TEST(WalkerNode, StandsBalanced) {
  Rig rig;
  rig.ready();
  rig.run(2s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING);
  EXPECT_EQ(rig.feedback.steps(), 0U);
  ASSERT_EQ(rig.feedback.feet_size(), 2);
  EXPECT_EQ(rig.feedback.hands_in_world_m_size(), 2);
  EXPECT_NEAR(rig.feedback.position_pelvis_in_world_m().z_m(),
              biped().X_WB_half_sitting.translation().z(), 0.01);
  EXPECT_LT(std::abs(rig.balance.zmp_measured_in_world_m().x_m() -
                     rig.balance.zmp_planned_in_world_m().x_m()),
            0.005);
  EXPECT_EQ(rig.status.failed_solves(), 0U);
  EXPECT_GT(rig.status.mean_tick_s(), 0.0);
  EXPECT_GE(rig.status.worst_tick_s(), rig.status.mean_tick_s());
  const auto frames = rig.bus.take_last<foxglove::FrameTransforms>("transforms");
  ASSERT_TRUE(frames.has_value());
  EXPECT_EQ(frames->transforms_size(), static_cast<int>(biped().tree.links().size()));
}

TEST(WalkerNode, TellsItsStatusAtChangesAndOnceASecond) {
  Rig rig;
  rig.ready();
  const int before = rig.statuses;
  rig.run(5s);
  EXPECT_EQ(rig.statuses - before, 5);
}

TEST(WalkerNode, StandsWhereItIsPut) {
  WalkerParams p = params();
  p.start = {.x_m = 2.0, .y_m = -1.0, .heading_rad = 1.0};
  Rig rig(p);
  rig.ready();
  EXPECT_NEAR(rig.feedback.position_pelvis_in_world_m().x_m(), 2.0, 0.05);
  EXPECT_NEAR(rig.feedback.position_pelvis_in_world_m().y_m(), -1.0, 0.05);
  EXPECT_NEAR(rig.feedback.heading_rad(), 1.0, 0.01);
}

TEST(WalkerNode, WalksAsAMotionWishesAndStopsWhenItEnds) {
  Rig rig;
  rig.ready();
  rig.walk(0.2);
  rig.run(6s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_WALKING);
  EXPECT_TRUE(rig.went_through(v1::WALK_STATE_STARTING));
  EXPECT_GE(rig.feedback.steps(), 4U);
  const double x_m = rig.feedback.position_pelvis_in_world_m().x_m();
  EXPECT_GT(x_m, 0.5);
  EXPECT_LT(std::abs(rig.feedback.position_pelvis_in_world_m().y_m()), 0.1);
  const std::uint32_t steps = rig.feedback.steps();
  rig.motion.reset();
  rig.run(4s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING);
  EXPECT_TRUE(rig.went_through(v1::WALK_STATE_STOPPING));
  EXPECT_LE(rig.feedback.steps() - steps, 3U);  // the one it was in, and two
}

TEST(WalkerNode, StopsForAMotionThatStands) {
  Rig rig;
  rig.ready();
  rig.walk(0.15);
  rig.run(4s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_WALKING);
  rig.motion->set_stands(true);
  rig.run(4s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING);
}

TEST(WalkerNode, WalksNoFasterThanItCanAndCounts) {
  Rig rig;
  rig.ready();
  rig.walk(1.06);
  rig.run(5s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_WALKING);
  EXPECT_LT(rig.feedback.velocity_pelvis_in_world().x_m_s(), 0.6);
  EXPECT_GE(rig.status.clipped_wishes(), 700U);
}

TEST(WalkerNode, TakesTheRawVelocityIfItIsTold) {
  WalkerParams p = params();
  p.use_smooth_velocity = false;
  Rig rig(p);
  rig.ready();
  rig.walk(0.2);
  rig.motion->set_smooth_velocity_forward_m_s(0.0);
  rig.run(3s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_WALKING);
}

v1::MotionRows rows_of_all_joints() {
  v1::MotionRows rows;
  rows.set_model("test");
  rows.add_rows("pelvis.x");
  for (const std::string& joint : biped().tree.joint_names()) rows.add_rows(joint);
  return rows;
}

/// All joints half-sitting, but `joint` at `rad`.
void set_angles(std::string_view joint, double rad, v1::Motion& motion) {
  motion.add_position_rad(9.9);  // a row that is no joint of the robot
  for (const double q : biped().half_sitting) motion.add_position_rad(q);
  motion.set_position_rad(1 + biped().tree.require_joint(joint), rad);
}

TEST(WalkerNode, MovesTheUpperBodyByTheNamesOfTheRows) {
  Rig rig;
  rig.ready();
  const int joint = biped().tree.require_joint("left_shoulder_pitch");
  rig.bus.send("rows", rows_of_all_joints(), rig.now);
  rig.motion.emplace();
  set_angles("left_shoulder_pitch", -0.3, *rig.motion);
  rig.run(3s);
  EXPECT_EQ(rig.status.reason(), "");
  EXPECT_NEAR(rig.command->position_rad(joint), -0.3, 0.03);
  EXPECT_EQ(rig.status.clipped_wishes(), 0U);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING);
  rig.motion->set_position_rad(1 + joint, 30.0);
  rig.run(3s);
  EXPECT_LE(rig.command->position_rad(joint), biped().tree.upper()[joint]);
  EXPECT_GE(rig.status.clipped_wishes(), 400U);  // said once a second
}

TEST(WalkerNode, RefusesAMotionThatItCannotRead) {
  const auto refused = [](const std::function<void(Rig&)>& spoil, const std::string& why) {
    Rig rig;
    rig.ready();
    rig.walk(0.2);
    rig.bus.send("rows", rows_of_all_joints(), rig.now);
    set_angles("left_elbow", -0.6, *rig.motion);
    spoil(rig);
    rig.run(1s);
    EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING) << why;
    EXPECT_EQ(rig.status.reason(), why);
    rig.walk(0.2);  // without joints
    rig.run(1500ms);
    EXPECT_EQ(rig.status.reason(), "");
    EXPECT_NE(rig.state(), v1::WALK_STATE_STANDING) << why;
  };
  refused([](Rig& r) { r.motion->add_position_rad(0.0); }, "motion of 32 joints, its rows are 31");
  refused([](Rig& r) { r.motion->add_velocity_rad_s(0.0); },
          "motion with 1 joint rates, its rows are 31");
  refused(
      [](Rig& r) {
        v1::MotionRows rows = rows_of_all_joints();
        for (std::string& row : *rows.mutable_rows()) {
          if (row == "left_elbow") row = "lelbow.x";
        }
        r.bus.send("rows", rows, r.now);
      },
      "rows of motion 'test' have no joint 'left_elbow', expected all of the upper body");
  refused([](Rig& r) { r.motion->add_landings(); }, "landing 0 names no foot");
  refused(
      [](Rig& r) {
        r.motion->add_landings()->set_foot(v1::FOOT_LEFT);
        r.motion->add_landings()->set_foot(v1::FOOT_LEFT);
      },
      "both landings are of the same foot");
}

TEST(WalkerNode, JointsWithoutRowsAreRefused) {
  Rig rig;
  rig.ready();
  rig.walk(0.2);
  set_angles("left_elbow", -0.6, *rig.motion);
  rig.run(1s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING);
  EXPECT_EQ(rig.status.reason(), "motion with joints, and no rows yet that name them");
}

TEST(WalkerNode, AMotionThatIsNotANumberEndsTheSteps) {
  Rig rig;
  rig.ready();
  rig.walk(0.2);
  rig.run(4s);
  rig.motion->set_smooth_velocity_forward_m_s(kNan);
  rig.run(4s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING);
  EXPECT_GE(rig.bus.counters("motion").rejected, 790U);
}

TEST(WalkerNode, SensorsThatFallSilentEndTheStepsThenThePostureIsHeld) {
  Rig rig;
  rig.ready();
  rig.walk(0.2);
  rig.run(4s);
  rig.sends_body = false;
  rig.run(100ms);
  EXPECT_NE(rig.state(), v1::WALK_STATE_SAFE);
  EXPECT_EQ(rig.status.reason(), "IMU and foot forces are silent");
  const std::uint32_t steps = rig.feedback.steps();
  rig.run(4s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_SAFE);
  EXPECT_EQ(rig.status.reason(), "IMU and foot forces are silent");
  EXPECT_LE(rig.feedback.steps() - steps, 3U);
  rig.fastest_rad_s = 0.0;
  rig.run(1s);
  ASSERT_TRUE(rig.command.has_value());  // holds
  EXPECT_EQ(rig.fastest_rad_s, 0.0);
  rig.motion.reset();
  rig.sends_body = true;
  rig.run(4s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING);
}

TEST(WalkerNode, SensorsThatAreNotNumbersAreSilent) {
  Rig rig;
  rig.ready();
  rig.sends_body = false;
  for (int i = 0; i < 40; ++i) {
    v1::BodySensors bad = rig.robot.sensors();
    bad.mutable_gyro_in_imu()->set_x_rad_s(kNan);
    rig.bus.send("sensors", bad, rig.now);
    rig.run(5ms);
  }
  EXPECT_EQ(rig.state(), v1::WALK_STATE_SAFE);
  EXPECT_EQ(rig.status.reason(), "IMU and foot forces are silent");
}

TEST(WalkerNode, SensorsThatMakeNoSenseAreNotUsed) {
  const auto refused = [](const std::function<void(v1::BodySensors&)>& spoil,
                          const std::string& why) {
    Rig rig;
    rig.ready();
    rig.sends_body = false;
    v1::BodySensors bad = rig.robot.sensors();
    spoil(bad);
    rig.bus.send("sensors", bad, rig.now);
    rig.run(10ms);
    EXPECT_EQ(rig.state(), v1::WALK_STATE_SAFE);
    EXPECT_EQ(rig.status.reason(), why);
  };
  refused([](v1::BodySensors& s) { s.mutable_world_from_imu()->set_w(1.5); },
          "attitude of the IMU has length 1.5, expected 1");
  refused([](v1::BodySensors& s) { s.mutable_feet()->RemoveLast(); },
          "foot forces of one foot only, expected both");
  refused([](v1::BodySensors& s) { s.mutable_feet(0)->set_foot(v1::FOOT_UNSPECIFIED); },
          "a foot force that names no foot");
}

TEST(WalkerNode, EncodersOfAnotherRobotAreNotUsed) {
  Rig rig;
  rig.sends_joints = false;
  v1::ArmState arm;
  arm.set_operational(true);
  for (int j = 0; j < 7; ++j) arm.add_position_rad(0.0);
  rig.bus.send("joints", arm, rig.now);
  rig.run(10ms);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_WAITING);
  EXPECT_EQ(rig.status.reason(), "encoders of 7 positions and 0 rates, the robot has 30 joints");
}

TEST(WalkerNode, DrivesThatStopEndTheStreamAndItBeginsAnew) {
  Rig rig;
  rig.ready();
  rig.robot.operational = false;
  rig.run(10ms);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_WAITING);
  EXPECT_EQ(rig.status.reason(), "the bridge does not follow yet");
  rig.run(100ms);
  EXPECT_FALSE(rig.command.has_value());  // the bridge wants silence first
  rig.run(200ms);
  EXPECT_TRUE(rig.command.has_value());
  rig.robot.operational = true;
  rig.run(1s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING);
}

TEST(WalkerNode, AFallIsSafeWithItsReasonAndNoFurtherSteps) {
  Rig rig;
  rig.ready();
  rig.walk(0.2);
  rig.run(4s);
  rig.robot.tilt = Eigen::AngleAxisd(1.0, Eigen::Vector3d::UnitY());
  rig.run(500ms);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_SAFE);
  EXPECT_NE(rig.status.reason(), "");
  rig.robot.tilt.setIdentity();
  const std::uint32_t steps = rig.feedback.steps();
  rig.fastest_rad_s = 0.0;
  rig.run(3s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_SAFE);
  EXPECT_EQ(rig.feedback.steps(), steps);
  EXPECT_EQ(rig.fastest_rad_s, 0.0);
}

TEST(WalkerNode, SameInputsSameBits) {
  const auto run = [] {
    Rig rig;
    rig.walk(0.2);
    rig.run(4s);
    return rig.feedback.SerializeAsString() + rig.balance.SerializeAsString() +
           rig.command->SerializeAsString();
  };
  EXPECT_EQ(run(), run());
}

TEST(WalkerNode, BadParametersNameTheirKey) {
  const auto refused = [](const std::function<void(WalkerParams&)>& spoil,
                          const std::string& what) {
    WalkerParams p = params();
    spoil(p);
    Loopback bus;
    try {
      const WalkerNode node(p, bus);
      ADD_FAILURE() << "accepted: " << what;
    } catch (const ConfigError& e) {
      EXPECT_NE(std::string(e.what()).find(what), std::string::npos) << e.what();
    }
  };
  refused([](WalkerParams& p) { p.robot = "lwr4.yaml"; }, "lwr4.yaml");
  refused([](WalkerParams& p) { p.gait.double_support_s = 0.6; }, "walker.gait.double_support_s");
  refused([](WalkerParams& p) { p.gait.narrowest_step_m = 0.5; }, "narrowest_step_m");
}

}  // namespace
}  // namespace mimesis::walker
