#include "nodes/walker/walker_node.h"

#include <gtest/gtest.h>

#include "nodes/walker/test/node_rig.h"

namespace mimesis::walker {
namespace {

using namespace std::chrono_literals;
using testing::biped;
using testing::params;
using testing::Rig;

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
  rig.robot.tilt = Eigen::AngleAxisd(0.17, Eigen::Vector3d::UnitX());
  rig.run(100ms);
  EXPECT_EQ(rig.status.reason(), "the trunk is tilted by 0.17 rad, at most 0.15 to begin");
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
  EXPECT_GT(rig.status.worst_tick_s(), rig.status.mean_tick_s());
}

TEST(WalkerNode, TellsItsStatusAtChangesAndOnceASecond) {
  Rig rig;
  rig.ready();
  const int before = rig.statuses;
  rig.run(5s);
  EXPECT_EQ(rig.statuses - before, 5);
  rig.walk(0.2);
  rig.run(10ms);
  EXPECT_EQ(rig.statuses - before, 6);
  EXPECT_EQ(rig.status.state(), v1::WALK_STATE_STARTING);
}

TEST(WalkerNode, TellsFramesOfItsLinksTwentyFiveTimesASecond) {
  Rig rig;
  rig.ready();
  while (rig.bus.take<foxglove::FrameTransforms>("transforms")) {
  }
  rig.run(2s);
  int told = 0;
  std::optional<foxglove::FrameTransforms> frames;
  while (auto next = rig.bus.take<foxglove::FrameTransforms>("transforms")) {
    frames = std::move(next);
    ++told;
  }
  EXPECT_EQ(told, 50);
  ASSERT_EQ(frames->transforms_size(), std::ssize(biped().tree.links()));
  const auto& pelvis = frames->transforms(0);
  EXPECT_EQ(pelvis.timestamp().seconds(), 3);  // began at 1 s
  EXPECT_NEAR(pelvis.translation().z(), rig.feedback.position_pelvis_in_world_m().z_m(), 1e-4);
}

TEST(WalkerNode, DrawsWhereItsFeetAreAndTheNextOneLands) {
  const auto drawn = [](Rig& rig) {
    std::optional<foxglove::SceneUpdate> last;
    while (auto next = rig.bus.take<foxglove::SceneUpdate>("plan")) last = std::move(next);
    return last.value().entities(0);
  };
  Rig rig;
  rig.ready();
  const foxglove::SceneEntity stands = drawn(rig);
  ASSERT_EQ(stands.cubes_size(), 2) << "two soles, and no step";
  for (const robot::Side side : robot::kSides) {
    const foxglove::CubePrimitive& sole = stands.cubes(side);
    const auto& leg = biped().leg[side];
    EXPECT_NEAR(sole.size().x(), leg.max_S_m.x() - leg.min_S_m.x(), 1e-12);
    EXPECT_NEAR(sole.pose().position().y(),
                rig.feedback.feet(side).position_in_world_m().y_m() +
                    0.5 * (leg.max_S_m.y() + leg.min_S_m.y()),
                1e-6);
  }
  rig.walk(0.2);
  rig.run(2s);
  const foxglove::SceneEntity walks = drawn(rig);
  ASSERT_EQ(walks.cubes_size(), 3);
  const robot::Side swing =
      rig.feedback.landing().foot() == v1::FOOT_LEFT ? robot::kLeft : robot::kRight;
  EXPECT_GT(walks.cubes(2).pose().position().x(), walks.cubes(1 - swing).pose().position().x())
      << "the swing foot lands before the standing one";
  ASSERT_EQ(walks.spheres_size(), 4);
  EXPECT_NEAR(walks.spheres(0).pose().position().z(), biped().com_height_m, 0.05);
  for (int i = 1; i < 4; ++i) EXPECT_NEAR(walks.spheres(i).pose().position().z(), 0.0, 0.01);
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

TEST(WalkerNode, HoldsThePostureOnceItStoodStillItself) {
  for (const auto pause : {90ms, 110ms}) {
    Rig rig;
    rig.ready();
    rig.walk(0.2);
    rig.run(4s);
    ASSERT_EQ(rig.state(), v1::WALK_STATE_WALKING);
    const v1::JointCommand last = *rig.command;
    rig.now += pause;  // a step ends 5 ms before `now`
    rig.run(5ms);
    if (pause < 100ms) {
      EXPECT_EQ(rig.state(), v1::WALK_STATE_WALKING);
      continue;
    }
    EXPECT_EQ(rig.state(), v1::WALK_STATE_SAFE);
    EXPECT_EQ(rig.status.reason(), "the walker stood still for 0.1 s");
    for (int j = 0; j < last.position_rad_size(); ++j)
      EXPECT_EQ(rig.command->position_rad(j), last.position_rad(j));
  }
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

TEST(WalkerNode, FiguresOfTheStackHoldForTheRobotsOwnTasks) {
  const auto room_rad = [](double margin_rad) {
    WalkerParams p = params();
    p.stack.limit_margin_rad = margin_rad;  // no task is named
    Rig rig(p);
    rig.ready();
    const double limit = biped().tree.upper()[biped().tree.require_joint("left_shoulder_roll")];
    const int joint = rig.wish_joint("left_shoulder_roll", limit);
    rig.run(5s);
    return limit - rig.command->position_rad(joint);
  };
  EXPECT_LT(room_rad(0.01), 0.05);
  EXPECT_GT(room_rad(0.2), 0.19);
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

TEST(WalkerNode, MovesTheUpperBodyByTheNamesOfTheRows) {
  Rig rig;
  rig.ready();
  const int joint = rig.wish_joint("left_shoulder_pitch", -0.3);
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

}  // namespace
}  // namespace mimesis::walker
