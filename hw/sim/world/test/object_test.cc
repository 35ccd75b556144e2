#include <gtest/gtest.h>

#include <cmath>

#include "hw/sim/world/world.h"

namespace mimesis::world {
namespace {

constexpr double kDt = 1e-3;

/// A table top at z = 0 with a stand of 8 cm edge and 10 cm height at x = 0.3.
kin::Table object_table() {
  kin::Table t;
  t.boxes = {{{0, 0, -0.05}, {0.5, 0.5, 0.05}, "table top"},
             {{0.3, 0, 0.05}, {0.04, 0.04, 0.05}, "stand"}};
  t.object = {0.0, 0.0, 0.06};
  t.object_radius = 0.02;
  t.object_height = 0.12;
  return t;
}

/// The object held by a hand that carried it to `center`, leaning by `lean` about y.
ObjectModel held_at(const Eigen::Vector3d& center, double lean = 0.0) {
  ObjectModel object(object_table());
  const Eigen::Isometry3d X_WE(Eigen::Translation3d(0, 0, 0.06));
  object.grasp(X_WE);
  object.carry(Eigen::Translation3d(center) * Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitY()));
  return object;
}

int steps_until_rest(ObjectModel& object) {
  int steps = 0;
  for (; object.state() == ObjectState::falling && steps < 10'000; ++steps) object.step(kDt);
  return steps;
}

TEST(Object, MovesRigidlyWithTheHand) {
  ObjectModel object(object_table());
  // x of E is vertical here: centring between the fingers moves nothing that this test looks at.
  const Eigen::Isometry3d X_WE = Eigen::Translation3d(0.0, -0.05, 0.06) *
                                 Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY());
  object.grasp(X_WE);
  const Eigen::Isometry3d motion = Eigen::Translation3d(0.2, 0.1, 0.3) *
                                   Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized());
  object.carry(motion * X_WE);
  const Eigen::Isometry3d expected = motion * Eigen::Translation3d(0, 0, 0.06);
  EXPECT_TRUE(object.cylinder().X_WO.isApprox(expected, 1e-12));
  EXPECT_TRUE(object.moved() && object.was_held());
}

TEST(Object, ClosingFingersCentreIt) {
  ObjectModel object(object_table());
  Eigen::Isometry3d X_WE(
      Eigen::Translation3d(0.005, 0.003, 0.06));  // x across the fingers, 5 mm off
  object.grasp(X_WE);
  EXPECT_LT((object.cylinder().X_WO.translation() - Eigen::Vector3d(0.005, 0.0, 0.06)).norm(),
            1e-12);
}

TEST(Object, FallsAsFreeBodiesDo) {
  ObjectModel object = held_at({0.1, 0.1, 0.06 + 0.5});
  object.release();
  for (int i = 0; i < 100; ++i) object.step(kDt);
  EXPECT_NEAR(object.cylinder().X_WO.translation().z(), 0.56 - 0.5 * 9.81 * 0.1 * 0.1, 1e-9);
  const double total = (100 + steps_until_rest(object)) * kDt;
  EXPECT_NEAR(total, std::sqrt(2 * 0.5 / 9.81), 1.01 * kDt);
}

TEST(Object, UpsideDownIsNotUpright) {
  ObjectModel object = held_at({0.0, 0.2, 0.061}, M_PI - 0.05);
  object.release();
  steps_until_rest(object);
  EXPECT_FALSE(object.upright());
  EXPECT_EQ(object.mishap(), "released upside down");
}

TEST(Object, StaysUprightFromALowReleaseOnly) {
  ObjectModel low = held_at({0.3, 0.0, 0.16 + 0.019});
  low.release();
  steps_until_rest(low);
  EXPECT_TRUE(low.upright());
  EXPECT_TRUE(low.mishap().empty());
  EXPECT_LT((low.cylinder().X_WO.translation() - Eigen::Vector3d(0.3, 0, 0.16)).norm(), 1e-12);

  ObjectModel high = held_at({0.3, 0.0, 0.16 + 0.021});
  high.release();
  steps_until_rest(high);
  EXPECT_FALSE(high.upright());
  EXPECT_EQ(high.mishap(), "dropped from 21.0 mm onto stand");
  EXPECT_NEAR(high.cylinder().X_WO.translation().z(), 0.10 + 0.02, 1e-12);  // lies on the stand
}

TEST(Object, RightsItselfWhileItsCentreIsAboveItsFoot) {  // atan(r / ½h) = 18.4°
  for (const auto& [lean, upright] : {std::pair(0.31, true), {0.33, false}, {-0.31, true}}) {
    ObjectModel object = held_at({0.0, 0.2, 0.066}, lean);
    object.release();
    steps_until_rest(object);
    EXPECT_EQ(object.upright(), upright) << lean;
    EXPECT_NEAR(object.cylinder().X_WO.translation().z(), upright ? 0.06 : 0.02, 1e-12);
  }
}

TEST(Object, PressedIntoItsSupportItIsLiftedBack) {
  ObjectModel object = held_at({0.3, 0.0, 0.16 - 0.003});
  object.release();
  EXPECT_EQ(steps_until_rest(object), 1);
  EXPECT_NEAR(object.cylinder().X_WO.translation().z(), 0.16, 1e-12);
}

TEST(Object, TopplesAcrossTheEdgeOfAStand) {
  ObjectModel inside = held_at({0.339, 0.0, 0.165});
  inside.release();
  steps_until_rest(inside);
  EXPECT_TRUE(inside.upright());
  ObjectModel outside = held_at({0.341, 0.0, 0.165});
  outside.release();
  steps_until_rest(outside);
  EXPECT_EQ(outside.mishap(), "released across the edge of stand");
  EXPECT_NEAR(outside.cylinder().X_WO.translation().z(), 0.02, 1e-12);
}

TEST(Object, BesideTheTableItFallsToTheFloor) {
  ObjectModel object = held_at({0.6, 0.0, 0.2});
  object.release();
  steps_until_rest(object);
  EXPECT_NEAR(object.cylinder().X_WO.translation().z(), -0.76 + 0.02, 1e-12);
  EXPECT_NE(object.mishap().find("onto floor"), std::string::npos);
}

TEST(Object, BelowAStandItDoesNotJumpUp) {
  ObjectModel object =
      held_at({0.3, 0.0, 0.11});  // inside the stand's column, its foot far below the top
  object.release();
  steps_until_rest(object);
  EXPECT_LT(object.cylinder().X_WO.translation().z(), 0.11);
}

TEST(Object, AboveTheBarItTopples) {
  kin::Table t = object_table();
  t.balls = {{{0.0, 0.3, 0.2}, 0.03}};
  ObjectModel object(t);
  object.grasp(Eigen::Isometry3d(Eigen::Translation3d(0, 0, 0.06)));
  object.carry(Eigen::Isometry3d(Eigen::Translation3d(0.0, 0.3, 0.35)));
  object.release();
  steps_until_rest(object);
  EXPECT_EQ(object.mishap(), "released above the bar");
}

TEST(Object, KnockedOverItLiesWhereItStood) {
  ObjectModel object(object_table());
  object.knock_over("fore ball 8");
  EXPECT_EQ(object.mishap(), "knocked over by fore ball 8");
  EXPECT_FALSE(object.upright());
  EXPECT_TRUE(object.moved());
  EXPECT_FALSE(object.was_held());
  EXPECT_LT((object.cylinder().X_WO.translation() - Eigen::Vector3d(0, 0, 0.02)).norm(), 1e-12);
}

}  // namespace
}  // namespace mimesis::world
