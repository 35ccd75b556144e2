// What the robot can knock against: itself, furniture; what it carries; what its ankles can bear.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hw/sim/body/body_world.h"
#include "hw/sim/body/test/bodies.h"

namespace mimesis::hw::sim {
namespace {

using Eigen::Vector3d;

class ObstaclesTest : public ::testing::Test {
 protected:
  ObstaclesTest() : q_(robot_.biped.half_sitting) {}
  void set(const std::string& joint, double angle_rad) {
    q_[robot_.biped.tree.require_joint(joint)] = angle_rad;
  }
  /// Evenly from half-sitting to the posture, in this time, and half a second more.
  void go(BodyWorld& world, double duration_s) {
    const int ticks = static_cast<int>(duration_s / kTick_s);
    for (int i = 1; i <= ticks + 100; ++i) {
      const double share = std::min(1.0, static_cast<double>(i) / ticks);
      const Eigen::VectorXd q =
          robot_.biped.half_sitting + share * (q_ - robot_.biped.half_sitting);
      world.step({q.data(), static_cast<std::size_t>(q.size())}, kTick_s);
    }
  }
  double torque(const BodyWorld& world, const std::string& joint) const {
    return world.sensors().torque[robot_.biped.tree.require_joint(joint)];
  }

  TestRobot robot_ = test_robot();
  Eigen::VectorXd q_;
};

TEST_F(ObstaclesTest, ARobotThatStandsTouchesNothingButTheGround) {
  BodyWorld world(robot_.biped, robot_.urdf,
                  {.drawer = DrawerSettings{
                       .front_x_m = 0.5, .handle_height_m = 0.92, .object_height_m = 0.90}});
  go(world, 0.5);
  EXPECT_EQ(world.truth().self.steps, 0);
  EXPECT_EQ(world.truth().furniture.steps, 0);
}

TEST_F(ObstaclesTest, AHandDoesNotGoThroughItsThigh) {
  set("left_shoulder_roll", -0.1745);
  set("left_shoulder_pitch", 0.0);
  set("left_elbow", 0.0);
  BodyWorld world(robot_.biped, robot_.urdf, {});
  go(world, 1.0);
  const BodyTruth& truth = world.truth();
  EXPECT_GT(truth.self.steps, 100);
  EXPECT_LT(truth.self.deepest_m, 0.01);
  EXPECT_NE(truth.self.deepest_between.find("left_thigh"), std::string::npos)
      << truth.self.deepest_between;
  EXPECT_EQ(truth.furniture.steps, 0);
  // through the thigh it would be at 0.25 m - 0.63 m sin 0.17
  EXPECT_GT(truth.hand_W_m[robot::kLeft].y(), 0.155);
  EXPECT_FALSE(truth.fell);
  // the arm's motors bear the thigh's force, and no other joint's do: inner forces balance
  EXPECT_NEAR(truth.normal_n[0] + truth.normal_n[1], robot_.weight_n(), 5.0);
  EXPECT_LT(torque(world, "left_shoulder_roll"), -2.0) << "it presses inwards";
}

TEST_F(ObstaclesTest, AForearmStopsAtTheFurniture) {
  set("left_shoulder_roll", 0.0);
  set("left_elbow", -1.3);
  const auto reach = [&](double front_x_m) {
    BodyWorld world(robot_.biped, robot_.urdf,
                    {.drawer = DrawerSettings{.front_x_m = front_x_m,
                                              .handle_height_m = 0.92,
                                              .handle_left_m = -0.2,
                                              .object_height_m = 0.90}});
    go(world, 1.0);
    EXPECT_EQ(world.truth().furniture.steps > 0, front_x_m < 1.0);
    EXPECT_EQ(world.truth().self.steps, 0);
    return world.truth();
  };
  const BodyTruth free = reach(2.0), stopped = reach(0.15);
  EXPECT_GT(free.hand_W_m[robot::kLeft].x(), 0.27);
  EXPECT_LT(stopped.hand_W_m[robot::kLeft].x(), 0.15 + 0.07 + 0.02) << "the panel is there";
  EXPECT_LT(stopped.furniture.deepest_m, 0.01);
}

TEST_F(ObstaclesTest, FurnitureThatIsPushedPushesAHand) {
  set("left_shoulder_roll", 0.0);
  set("left_elbow", -1.3);
  const DrawerSettings settings{.front_x_m = 0.35,
                                .handle_height_m = 0.92,
                                .handle_left_m = -0.2,
                                .object_height_m = 0.90,
                                .jumps = {{.at_s = 1.6, .by_m = -0.1}}};
  BodyWorld world(robot_.biped, robot_.urdf, {.drawer = settings});
  Drawer drawer(settings);
  go(world, 1.0);
  EXPECT_EQ(world.truth().furniture.steps, 0);
  const double before = world.truth().hand_W_m[robot::kLeft].x();
  for (int i = 0; i < 100; ++i) {
    world.step({q_.data(), static_cast<std::size_t>(q_.size())}, kTick_s);
    world.move(drawer, {false, false}, kTick_s);
  }
  EXPECT_NEAR(drawer.now().front_W_m.x(), 0.25, 1e-9);
  EXPECT_GT(world.truth().furniture.steps, 0);
  EXPECT_LT(world.truth().hand_W_m[robot::kLeft].x(), before - 0.005);
}

/// The panel comes out of the cabinet with the hand that pulls its handle, to the other hand.
TEST_F(ObstaclesTest, ADrawerThatIsPulledPushesTheOtherHand) {
  for (const char* side : {"left", "right"}) {
    set(std::string(side) + "_shoulder_roll", 0.0);
    set(std::string(side) + "_elbow", -1.3);
  }
  BodyWorld alone(robot_.biped, robot_.urdf, {});
  go(alone, 1.0);
  const Vector3d hand = alone.truth().hand_W_m[robot::kLeft];
  const DrawerSettings settings{.front_x_m = hand.x(),
                                .handle_height_m = hand.z(),
                                .handle_left_m = hand.y(),
                                .object_height_m = hand.z() + 0.1};
  BodyWorld world(robot_.biped, robot_.urdf, {.drawer = settings});
  Drawer drawer(settings);
  go(world, 1.0);
  ASSERT_EQ(world.truth().furniture.steps, 0);
  const double before = world.truth().hand_W_m[robot::kRight].x();
  const Eigen::VectorXd from = q_;
  set("left_shoulder_pitch", q_[robot_.biped.tree.require_joint("left_shoulder_pitch")] + 0.4);
  for (int i = 0; i < 300; ++i) {
    const Eigen::VectorXd q = from + std::clamp((i - 60) / 200.0, 0.0, 1.0) * (q_ - from);
    world.move(drawer, {true, false}, kTick_s);
    world.step({q.data(), static_cast<std::size_t>(q.size())}, kTick_s);
  }
  ASSERT_GT(drawer.now().opened_m, 0.04);
  EXPECT_GT(world.truth().furniture.steps, 0);
  EXPECT_LT(world.truth().hand_W_m[robot::kRight].x(), before - 0.005);
}

/// The ground bears the object's weight, and the elbow m g times its lever.
TEST_F(ObstaclesTest, TheObjectIsFeltInTheArm) {
  set("right_elbow", -1.3);
  DrawerSettings settings{.front_x_m = 5.0, .handle_height_m = 0.92, .object_height_m = 0.90};
  settings.object_kg = 0.3;
  BodyWorld world(robot_.biped, robot_.urdf, {.drawer = settings});
  go(world, 1.0);
  const auto ground = [&] {  // mean of half a second: it sways
    double sum = 0.0;
    for (int i = 0; i < 100; ++i) {
      world.step({q_.data(), static_cast<std::size_t>(q_.size())}, kTick_s);
      sum += 0.01 * (world.truth().normal_n[0] + world.truth().normal_n[1]);
    }
    return sum;
  };
  const double before = ground(), elbow = torque(world, "right_elbow");
  const Vector3d hand = world.truth().hand_W_m[robot::kRight];
  DrawerSettings here = settings;  // what the hand is at, far from the furniture
  here.object_depth_m = hand.x() - here.front_x_m;
  here.object_left_m = hand.y();
  here.object_height_m = hand.z();
  Drawer drawer(here);
  for (int i = 0; i < 200; ++i) {
    world.move(drawer, {false, true}, kTick_s);
    world.step({q_.data(), static_cast<std::size_t>(q_.size())}, kTick_s);
  }
  ASSERT_TRUE(drawer.now().taken);
  const double weight = 0.3 * robot::kGravity;
  EXPECT_NEAR(ground() - before, weight, 0.1 * weight);
  // forearm and hand: 0.38 m along the elbow's arm, 0.25 m below the shoulder
  robot::Kinematics kinematics(robot_.biped.tree);
  kinematics.update(world.truth().X_WB, world.sensors().q);
  const int elbow_link = robot_.biped.tree.require_link("right_forearm");
  const double lever = hand.x() - kinematics.X_WL(elbow_link).translation().x();
  // the joint's axis is y: bending forward and up is negative
  EXPECT_NEAR(torque(world, "right_elbow") - elbow, -weight * lever, 0.1 * weight * lever);
}

TEST_F(ObstaclesTest, AnkleBearsNoMoreThanItsLimit) {
  const auto most = [&](double limit_n_m) {
    BodyWorld world(robot_.biped, robot_.urdf, {.ankle_pitch_n_m = limit_n_m});
    go(world, 0.2);
    world.push({.at_s = world.time_s(), .impulse_W_ns = {9.0, 0.0, 0.0}});
    double peak = 0.0;
    for (int i = 0; i < 100; ++i) {
      world.step(robot_.half_sitting(), kTick_s);
      peak = std::max({peak, std::abs(torque(world, "left_ankle_pitch")),
                       std::abs(torque(world, "right_ankle_pitch"))});
    }
    return peak;
  };
  EXPECT_GT(most(0.0), 30.0);
  const double limited = most(20.0);
  EXPECT_LT(limited, 22.0);
  EXPECT_GT(limited, 15.0);
}

}  // namespace
}  // namespace mimesis::hw::sim
