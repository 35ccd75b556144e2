// Tests of the node with unusable input, and with failures around it.
#include <gtest/gtest.h>

#include <functional>

#include "common/error.h"
#include "common/testing/refusal.h"
#include "nodes/walker/test/node_rig.h"

namespace mimesis::walker {
namespace {

using namespace std::chrono_literals;
using testing::biped;
using testing::kNan;
using testing::params;
using testing::Rig;
using testing::rows_of_all_joints;
using testing::set_angles;

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
    rig.motion.reset();
    rig.run(200ms);
    EXPECT_EQ(rig.status.reason(), "");
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
  rig.states.clear();
  rig.sends_body = false;
  rig.run(100ms);
  EXPECT_NE(rig.state(), v1::WALK_STATE_SAFE);
  EXPECT_EQ(rig.status.reason(), "IMU and foot forces are silent");
  const std::uint32_t steps = rig.feedback.steps();
  rig.run(4s);
  EXPECT_TRUE(rig.went_through(v1::WALK_STATE_STOPPING));
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

TEST(WalkerNode, EncodersAndForcesThatAreNotNumbersAreSilent) {
  const auto silent = [](const std::function<void(v1::BodySensors&, v1::JointState&)>& spoil,
                         const std::string& why) {
    Rig rig;
    rig.ready();
    rig.walk(0.2);
    rig.run(3s);
    rig.sends_body = rig.sends_joints = false;
    for (int i = 0; i < 600; ++i) {
      v1::BodySensors body = rig.robot.sensors();
      v1::JointState joints = rig.robot.joints();
      spoil(body, joints);
      rig.bus.send("sensors", body, rig.now);
      rig.bus.send("joint_states", joints, rig.now);
      rig.run(5ms);
      ASSERT_TRUE(rig.command.has_value());
      for (const double q : rig.command->position_rad()) ASSERT_TRUE(std::isfinite(q)) << why;
    }
    EXPECT_EQ(rig.state(), v1::WALK_STATE_SAFE) << why;
    EXPECT_EQ(rig.status.reason(), why);
  };
  silent([](v1::BodySensors&, v1::JointState& a) { a.set_position_rad(7, kNan); },
         "encoders are silent");
  silent([](v1::BodySensors&, v1::JointState& a) { a.set_velocity_rad_s(7, HUGE_VAL); },
         "encoders are silent");
  silent([](v1::BodySensors& b, v1::JointState&) { b.mutable_feet(1)->set_force_z_n(kNan); },
         "IMU and foot forces are silent");
}

TEST(WalkerNode, AGoalOutOfReachIsApproachedAsFarAsTheRobotCan) {
  Rig rig;
  rig.ready();
  rig.walk(0.2);
  v1::Footprint& far = *rig.motion->add_landings();  // ten metres away, behind a leg's reach
  far.set_foot(v1::FOOT_LEFT);
  far.mutable_position_in_world_m()->set_x_m(10.0);
  far.mutable_position_in_world_m()->set_y_m(4.0);
  v1::HandGoal& hand = *rig.motion->add_hands();
  hand.set_left(true);
  hand.set_share(1.0);
  hand.mutable_position_in_world_m()->set_x_m(50.0);
  for (int i = 0; i < 800; ++i) {
    rig.run(5ms);
    for (int j = 0; j < rig.command->position_rad_size(); ++j) {
      ASSERT_LE(rig.command->position_rad(j), biped().tree.upper()[j]);
      ASSERT_GE(rig.command->position_rad(j), biped().tree.lower()[j]);
    }
  }
  EXPECT_EQ(rig.state(), v1::WALK_STATE_WALKING) << rig.status.reason();
  EXPECT_GE(rig.feedback.steps(), 3U);
  EXPECT_GE(rig.status.clipped_wishes(), 500U);
  EXPECT_EQ(rig.status.failed_solves(), 0U);
  rig.motion.reset();
  rig.run(4s);
  EXPECT_EQ(rig.state(), v1::WALK_STATE_STANDING) << rig.status.reason();
  EXPECT_EQ(rig.status.reason(), "");
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
  v1::JointState arm;
  arm.set_operational(true);
  for (int j = 0; j < 7; ++j) arm.add_position_rad(0.0);
  rig.bus.send("joint_states", arm, rig.now);
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
  const int balances = rig.balances;
  rig.run(100ms);
  EXPECT_FALSE(rig.command.has_value());  // the bridge wants silence first
  EXPECT_EQ(rig.balances, balances);
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

TEST(WalkerNode, BadParametersNameTheirKey) {
  const auto refused = [](const std::function<void(WalkerParams&)>& spoil,
                          const std::string& what) {
    WalkerParams p = params();
    spoil(p);
    mimesis::testing::Loopback bus;
    const std::string words = mimesis::testing::refusal([&] { const WalkerNode node(p, bus); });
    EXPECT_NE(words.find(what), std::string::npos) << words;
  };
  refused([](WalkerParams& p) { p.robot = "lwr4.yaml"; }, "lwr4.yaml");
}

}  // namespace
}  // namespace mimesis::walker
