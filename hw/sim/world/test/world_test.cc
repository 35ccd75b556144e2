#include "hw/sim/world/world.h"

#include <gtest/gtest.h>

#include "common/model/files.h"
#include "hw/sim/world/test/postures.h"

namespace mimesis::world {
namespace {

constexpr double kWorldDt = 0.01;
constexpr double kClosed = 0.25;  // beyond the contact at 1 − 44/58 = 0.241

/// The real arm and table, moved through postures that inverse kinematics found.
class WorldTest : public ::testing::Test {
 protected:
  WorldTest()
      : arm_(model::load_arm(std::string(MIMESIS_SOURCE_DIR) + "/models/lwr4.yaml")),
        table_(model::load_table(std::string(MIMESIS_SOURCE_DIR) + "/models/bar_table.yaml")),
        world_(arm_, table_),
        search_(arm_, table_) {}

  void step(const Eigen::VectorXd& q, const Hand& hand, int steps = 1) {
    for (int i = 0; i < steps; ++i) world_.step(kWorldDt, q, hand);
  }
  Reach some_grasp(Grip grip) {
    const std::vector<Reach> reaches = search_.grasps(grip, 200);
    EXPECT_FALSE(reaches.empty());
    return reaches.at(0);
  }

  kin::ArmModel arm_;
  kin::Table table_;
  World world_;
  PostureSearch search_;
};

TEST_F(WorldTest, CarriesTheObjectToTheHighGoal) {
  const Reach grasp = some_grasp(Grip::precision);
  step(arm_.home, {Grip::precision, 0.0});
  EXPECT_FALSE(world_.contact().reachable);
  step(grasp.before, {Grip::precision, 0.0});
  EXPECT_FALSE(world_.contact().reachable);
  step(grasp.at, {Grip::precision, 0.0});
  EXPECT_TRUE(world_.contact().reachable);
  EXPECT_EQ(world_.object().state(), ObjectState::resting);  // an open hand holds nothing
  step(grasp.at, {Grip::precision, kClosed});
  EXPECT_EQ(world_.object().state(), ObjectState::held);
  EXPECT_TRUE(world_.contact().reachable);  // the hand keeps feeling it
  step(grasp.before, {Grip::precision, kClosed});
  EXPECT_NEAR(world_.object().cylinder().X_WO.translation().z(), table_.object.z() + 0.10, 1e-4);

  const auto places = search_.places(Grip::precision, 200, table_.goals[0].position);
  ASSERT_FALSE(places.empty());
  step(places[0].before, {Grip::precision, kClosed});
  step(places[0].at, {Grip::precision, kClosed});
  step(places[0].at, {Grip::precision, 0.1});
  EXPECT_EQ(world_.object().state(), ObjectState::falling);
  step(places[0].at, {Grip::precision, 0.0}, 10);
  EXPECT_EQ(world_.object().state(), ObjectState::resting);
  step(places[0].before, {Grip::precision, 0.0});
  const Verdict verdict =
      judge({.done = true, .goal = "high", .reason = ""}, world_.object(), table_.goals);
  EXPECT_TRUE(verdict.placed) << verdict.reason;
  EXPECT_LT(verdict.placement_error, 1e-3);
  EXPECT_EQ(world_.collisions().count(), 0) << world_.collisions().last();
}

TEST_F(WorldTest, TheWrongGripGraspsNothing) {
  const Reach grasp = some_grasp(Grip::precision);
  step(grasp.at, {Grip::full, kClosed}, 5);
  EXPECT_EQ(world_.object().state(), ObjectState::resting);
}

TEST_F(WorldTest, AHandClosingBesideTheObjectGraspsNothing) {
  const Reach grasp = some_grasp(Grip::full);
  step(grasp.before, {Grip::full, kClosed}, 5);
  EXPECT_EQ(world_.object().state(), ObjectState::resting);
  EXPECT_FALSE(world_.object().moved());
}

TEST_F(WorldTest, OpeningInTheAirDropsIt) {
  const Reach grasp = some_grasp(Grip::full);
  step(grasp.at, {Grip::full, kClosed});
  const auto lifted =
      kin::solve_ik(arm_, grasp.pose.goal(table_.object, table_.object_height, 0, 0.06), grasp.at);
  ASSERT_TRUE(lifted);
  step(*lifted, {Grip::full, kClosed});
  step(*lifted, {Grip::full, 0.0}, 100);
  EXPECT_EQ(world_.object().state(), ObjectState::resting);
  EXPECT_EQ(world_.object().mishap(), "dropped from 60.0 mm onto plinth");
}

TEST_F(WorldTest, ASlackGripStillHoldsAndAnOpenOneDoesNot) {
  const Reach grasp = some_grasp(Grip::full);
  step(grasp.at, {Grip::full, kClosed});
  const double contact = world_.contact().closure;
  step(grasp.at, {Grip::full, contact - 0.029});
  EXPECT_EQ(world_.object().state(), ObjectState::held);
  step(grasp.at, {Grip::full, contact - 0.031});
  EXPECT_NE(world_.object().state(), ObjectState::held);
}

TEST_F(WorldTest, SweepingThroughTheObjectKnocksItOver) {
  const Reach grasp = some_grasp(Grip::precision);
  // Lowered by 6 cm more, with the palm where the object is.
  const auto low = kin::solve_ik(
      arm_, grasp.pose.goal(table_.object, table_.object_height, -0.06, 0.0), grasp.at);
  ASSERT_TRUE(low);
  step(*low, {Grip::precision, 0.0});
  EXPECT_FALSE(world_.object().upright());
  EXPECT_EQ(world_.object().mishap().rfind("knocked over by hand ball", 0), 0u)
      << world_.object().mishap();
  EXPECT_GE(world_.collisions().count(), 1);
  step(grasp.at, {Grip::precision, kClosed}, 3);
  EXPECT_EQ(world_.object().state(), ObjectState::resting);  // a lying object is not grasped
}

TEST_F(WorldTest, WithoutAPostureNothingHappens) {
  for (int i = 0; i < 10; ++i) world_.step(kWorldDt);
  EXPECT_TRUE(world_.frames().empty());
  EXPECT_EQ(world_.object().state(), ObjectState::resting);
  EXPECT_FALSE(world_.contact().reachable);
}

}  // namespace
}  // namespace mimesis::world
