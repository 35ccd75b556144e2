// Tests of the node's own place, time and past.
#include <gtest/gtest.h>

#include "nodes/walker/test/node_rig.h"

namespace mimesis::walker {
namespace {

using namespace std::chrono_literals;
using testing::biped;
using testing::params;
using testing::Rig;

Eigen::Vector3d to_vector(const v1::Vector3& v) { return {v.x_m(), v.y_m(), v.z_m()}; }

/// Feet, pelvis and hands of a robot that sits half at `start`; pelvis and hands within `by_m`.
void expect_half_sitting_at(const PlaceParams& start, const v1::WalkFeedback& said, double by_m) {
  const Eigen::Isometry3d X_WG = Eigen::Translation3d(start.x_m, start.y_m, 0.0) *
                                 Eigen::AngleAxisd(start.heading_rad, Eigen::Vector3d::UnitZ());
  robot::Kinematics kinematics(biped().tree);
  kinematics.update(X_WG * biped().X_WB_half_sitting, biped().half_sitting);
  ASSERT_EQ(said.feet_size(), 2);
  ASSERT_EQ(said.hands_in_world_m_size(), 2);
  for (const Side side : robot::kSides) {
    const v1::Footprint& foot = said.feet(side);
    const Eigen::Vector3d sole = kinematics.X_WL(biped().leg[side].sole).translation(),
                          hand = kinematics.X_WL(biped().hand[side]).translation();
    EXPECT_EQ(foot.foot(), side == kLeft ? v1::FOOT_LEFT : v1::FOOT_RIGHT);
    EXPECT_LT((to_vector(foot.position_in_world_m()) - sole).norm(), 1e-9);
    EXPECT_NEAR(foot.yaw_rad(), start.heading_rad, 1e-9);
    EXPECT_LT((to_vector(said.hands_in_world_m(side)) - hand).norm(), by_m);
  }
  const Eigen::Vector3d pelvis = kinematics.X_WL(0).translation();
  EXPECT_LT((to_vector(said.position_pelvis_in_world_m()) - pelvis).norm(), by_m);
  EXPECT_NEAR(said.heading_rad(), start.heading_rad, 1e-3);
}

TEST(WalkerPlace, SaysWhereItIsBeforeItHasAPlanAndWithOne) {
  WalkerParams p = params();
  p.start = {.x_m = 2.0, .y_m = -1.0, .heading_rad = 2.0};
  Rig rig(p);
  rig.run(10ms);
  ASSERT_FALSE(rig.state() == v1::WALK_STATE_STANDING);
  expect_half_sitting_at(p.start, rig.feedback, 1e-9);
  EXPECT_EQ(rig.feedback.swing(), v1::FOOT_RIGHT);
  EXPECT_EQ(rig.feedback.landing().SerializeAsString(), rig.feedback.feet(1).SerializeAsString());
  rig.ready();
  expect_half_sitting_at(p.start, rig.feedback, 0.03);  // the CoM comes above the feet
}

/// Walks with a motion that is always where the robot is: nothing drifts, so nothing is added.
void walk_with_the_motion(Rig& rig, runtime::Time duration) {
  for (const runtime::Time end = rig.now + duration; rig.now < end;) {
    const auto &left = rig.feedback.feet(0), &right = rig.feedback.feet(1);
    const auto &l = left.position_in_world_m(), &r = right.position_in_world_m();
    rig.motion->mutable_position_pelvis_in_world_m()->set_x_m(0.5 * (l.x_m() + r.x_m()));
    rig.motion->mutable_position_pelvis_in_world_m()->set_y_m(0.5 * (l.y_m() + r.y_m()));
    rig.motion->set_heading_rad(0.5 * (left.yaw_rad() + right.yaw_rad()));
    rig.run(5ms);
  }
}

TEST(WalkerPlace, GoesAsWishedWhileTheMotionIsWhereTheRobotIs) {
  // A robot without inertia swings by 95 mm from tick to tick under the feedback of the divergent
  // component: steps must not be placed again because of this.
  WalkerParams p = params();
  p.stabilizer.step_adjustment = false;
  Rig rig(p);
  rig.ready();
  rig.walk(0.15);
  walk_with_the_motion(rig, 5s);
  const double x_m = rig.feedback.position_pelvis_in_world_m().x_m();
  walk_with_the_motion(rig, 6400ms);  // eight steps of 0.8 s
  // A drift that is none would add 0.03 m/s and more.
  EXPECT_NEAR((rig.feedback.position_pelvis_in_world_m().x_m() - x_m) / 6.4, 0.15, 0.01);
}

TEST(WalkerPlace, TurnsAsWishedWhileTheMotionLooksAsTheRobotDoes) {
  Rig rig;
  rig.ready();
  rig.walk(0.1);
  rig.motion->set_smooth_yaw_rate_rad_s(0.08);
  walk_with_the_motion(rig, 5s);
  const double heading = rig.feedback.heading_rad();
  walk_with_the_motion(rig, 3200ms);
  EXPECT_NEAR((rig.feedback.heading_rad() - heading) / 3.2, 0.08, 0.015);
}

TEST(WalkerPlace, IsAtRestWhenItDoesNotStep) {
  Rig rig;
  EXPECT_TRUE(rig.node.at_rest());
  rig.ready();
  EXPECT_TRUE(rig.node.at_rest());
  rig.walk(0.15);
  rig.run(3s);
  EXPECT_FALSE(rig.node.at_rest());
}

/// A motion is the state at its stamp: until the next one it is extrapolated at its rates.
TEST(WalkerPlace, AMotionThatIsLateGoesOnAtItsRates) {
  Rig rig;
  rig.ready();
  const int joint = rig.wish_joint("left_shoulder_pitch", -0.3);
  for (int i = 0; i < rig.motion->position_rad_size(); ++i) rig.motion->add_velocity_rad_s(0.0);
  rig.motion->set_velocity_rad_s(1 + joint, 0.5);
  rig.run(3s);
  const double before = rig.command->position_rad(joint);
  rig.motion.reset();
  rig.run(80ms);                                                   // less than until it has ended
  const double moved = rig.command->position_rad(joint) - before;  // the stack lags a little
  EXPECT_GT(moved, 0.5 * 0.5 * 0.08);
  EXPECT_LT(moved, 0.5 * 0.08);
}

TEST(WalkerPlace, FollowsAJointThatSagsUntilTheDrivesFollow) {
  Rig rig;
  rig.robot.operational = false;
  rig.run(300ms);
  ASSERT_TRUE(rig.command.has_value());
  const int elbow = biped().tree.require_joint("left_elbow");
  const double before = rig.command->position_rad(elbow);
  rig.robot.q[elbow] = before - 0.005;  // below the bridge's limit of jumps
  rig.run(5ms);
  EXPECT_EQ(rig.command->position_rad(elbow), before);
  rig.robot.q[elbow] = before - 0.05;
  rig.run(5ms);
  EXPECT_EQ(rig.command->position_rad(elbow), before - 0.05);
}

TEST(WalkerPlace, BalanceBeginsWithoutThePastOfTheArms) {
  Rig rig;
  rig.ready();
  const int shoulder = biped().tree.require_joint("left_shoulder_pitch");
  const double raised = biped().half_sitting[shoulder] - 0.25;
  const int joint = rig.wish_joint("left_shoulder_pitch", raised);
  rig.run(2s);
  ASSERT_NEAR(rig.command->position_rad(joint), raised, 0.03);
  rig.motion.reset();
  rig.robot.operational = false;
  rig.run(500ms);
  rig.robot.operational = true;
  for (int k = 0; k < 1000 && rig.state() != v1::WALK_STATE_STANDING; ++k) rig.run(5ms);
  ASSERT_EQ(rig.state(), v1::WALK_STATE_STANDING) << rig.status.reason();
  for (int k = 0; k < 60; ++k) {
    rig.run(5ms);
    EXPECT_NEAR(rig.command->position_rad(joint), biped().half_sitting[joint], 0.02);
  }
}

}  // namespace
}  // namespace mimesis::walker
