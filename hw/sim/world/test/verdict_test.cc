#include <gtest/gtest.h>

#include "hw/sim/world/world.h"

namespace mimesis::world {
namespace {

/// Flat table; goal high at x = 0.3, low at x = −0.3, both on the table; object 12
/// cm high at the origin.
kin::Table verdict_table() {
  kin::Table t;
  t.boxes = {{{0, 0, -0.05}, {0.5, 0.5, 0.05}, "table top"}};
  t.goals = {{"high", {0.3, 0, 0.06}, 0.02}, {"low", {-0.3, 0, 0.06}, 0.02}};
  t.object = {0.0, 0.0, 0.06};
  t.object_radius = 0.02;
  t.object_height = 0.12;
  return t;
}

ObjectModel carried_to(const Eigen::Vector3d& center) {
  ObjectModel object(verdict_table());
  object.grasp(Eigen::Isometry3d(Eigen::Translation3d(0, 0, 0.06)));
  object.carry(Eigen::Isometry3d(Eigen::Translation3d(center)));
  return object;
}

ObjectModel released_at(const Eigen::Vector3d& center) {
  ObjectModel object = carried_to(center);
  object.release();
  while (object.state() == ObjectState::falling) object.step(1e-3);
  return object;
}

const TaskEnd kDoneHigh{.done = true, .goal = "high", .reason = ""};

TEST(Verdict, PlacedWithinTheRadiusOnly) {
  const Verdict in = judge(kDoneHigh, released_at({0.3 + 0.0199, 0, 0.062}), verdict_table().goals);
  EXPECT_TRUE(in.placed);
  EXPECT_NEAR(in.placement_error, 0.0199, 1e-12);
  EXPECT_EQ(in.reason, "");
  const Verdict out = judge(kDoneHigh, released_at({0.3, -0.0342, 0.062}), verdict_table().goals);
  EXPECT_FALSE(out.placed);
  EXPECT_EQ(out.reason, "placed 34.2 mm from goal high (radius 20.0 mm)");
}

TEST(Verdict, TheOtherGoalDoesNotCount) {
  const Verdict verdict = judge(kDoneHigh, released_at({-0.3, 0, 0.062}), verdict_table().goals);
  EXPECT_FALSE(verdict.placed);
  EXPECT_NEAR(verdict.placement_error, 0.6, 1e-12);
}

TEST(Verdict, DroppedOntoTheGoalIsNotPlaced) {
  const Verdict verdict = judge(kDoneHigh, released_at({0.3, 0, 0.2}), verdict_table().goals);
  EXPECT_FALSE(verdict.placed);
  EXPECT_EQ(verdict.reason, "object dropped from 140.0 mm onto table top");
}

TEST(Verdict, HeldInTheAirAtTheGoalIsNotPlaced) {
  const Verdict verdict = judge(kDoneHigh, carried_to({0.3, 0, 0.06}), verdict_table().goals);
  EXPECT_FALSE(verdict.placed);
  EXPECT_EQ(verdict.reason, "object not released");
}

TEST(Verdict, AnUntouchedObjectIsNotPlaced) {
  kin::Table t = verdict_table();
  t.object = t.goals[0].position;  // it stood there from the start
  const Verdict verdict = judge(kDoneHigh, ObjectModel(t), t.goals);
  EXPECT_FALSE(verdict.placed);
  EXPECT_EQ(verdict.reason, "object not grasped");
}

TEST(Verdict, AFailureKeepsThePlannersReason) {
  const TaskEnd failed{.done = false, .goal = "high", .reason = "goal high is blocked"};
  const Verdict verdict = judge(failed, ObjectModel(verdict_table()), verdict_table().goals);
  EXPECT_FALSE(verdict.placed);
  EXPECT_EQ(verdict.reason, "goal high is blocked");
  EXPECT_NEAR(verdict.placement_error, 0.3, 1e-12);
  const TaskEnd silent{.done = false, .goal = "high", .reason = ""};
  EXPECT_EQ(judge(silent, ObjectModel(verdict_table()), verdict_table().goals).reason,
            "the planner failed without a reason");
}

TEST(Verdict, WithoutGoalThereIsNoError) {
  const TaskEnd end{.done = true, .goal = "", .reason = ""};
  const Verdict verdict = judge(end, released_at({0.3, 0, 0.062}), verdict_table().goals);
  EXPECT_FALSE(verdict.placed);
  EXPECT_EQ(verdict.placement_error, -1.0);
  EXPECT_EQ(verdict.reason, "no goal was decided");
}

}  // namespace
}  // namespace mimesis::world
