#include "hw/sim/world/collisions.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mimesis::world {
namespace {

/// One joint about z; a ball of the forearm 0.5 m along x, and one of the hand at 1.0 m.
kin::ArmModel arm() {
  kin::ArmModel a;
  a.links = {{.a = 1.0}};
  a.groups = {"base", "fore", "hand"};
  a.balls = {{.frame = 0, .group = 0, .center = {0, 0, 0}, .radius = 0.1},
             {.frame = 1, .group = 1, .center = {-0.5, 0, 0}, .radius = 0.1},
             {.frame = 1, .group = 2, .center = {0, 0, 0}, .radius = 0.05}};
  a.env_groups = {1, 2};
  a.self_pairs = {{0, 2}};
  return a;
}

/// A box in the way of the forearm at 90°, its face at y = 0.4; a ball of the bar in the way of the
/// hand at −90°.
kin::Table table() {
  kin::Table t;
  t.boxes = {{{0.0, 0.5, 0.0}, {0.05, 0.1, 0.5}, "shelf"}};
  t.balls = {{{0.0, -1.0, 0.0}, 0.03}, {{0.0, -1.02, 0.0}, 0.03}};
  return t;
}

/// Far away unless a test moves it.
ObjectInScene object(const Eigen::Vector3d& center = {5, 5, 5}) {
  ObjectInScene o;
  o.cylinder = {
      .X_WO = Eigen::Isometry3d(Eigen::Translation3d(center)), .radius = 0.02, .height = 0.12};
  return o;
}

class Scene {
 public:
  void turn_to(double q, const ObjectInScene& o = object()) {
    kin::forward(arm(), Eigen::VectorXd::Constant(1, q), X_);
    monitor.update(X_, o);
  }
  CollisionMonitor monitor{arm(), table()};

 private:
  std::vector<Eigen::Isometry3d> X_;
};

TEST(Collisions, AContactCountsOnceUntilTheBodiesPart) {
  Scene scene;
  scene.turn_to(0.0);
  EXPECT_EQ(scene.monitor.count(), 0);
  for (const double q : {1.5, 1.55, 1.6}) scene.turn_to(q);  // the forearm stays in the shelf
  EXPECT_EQ(scene.monitor.count(), 1);
  EXPECT_EQ(scene.monitor.last(), "fore ball 1 with shelf");
  scene.turn_to(0.5);
  scene.turn_to(1.5);
  EXPECT_EQ(scene.monitor.count(), 2);
}

TEST(Collisions, TouchingBeginsAtTheSumOfRadiiAndEndsOneMillimetreAway) {
  Scene scene;
  // Forearm ball at (0.5 cos q, 0.5 sin q): its gap to the face x = 0.05 is 0.5 cos q − 0.15 while
  // it is beside it.
  const auto q_of_gap = [](double gap) { return std::acos((0.15 + gap) / 0.5); };
  scene.turn_to(q_of_gap(1e-6));
  EXPECT_EQ(scene.monitor.count(), 0);
  scene.turn_to(q_of_gap(-1e-6));
  EXPECT_EQ(scene.monitor.count(), 1);
  scene.turn_to(q_of_gap(0.0009));
  scene.turn_to(q_of_gap(-1e-6));  // never really parted
  EXPECT_EQ(scene.monitor.count(), 1);
  scene.turn_to(q_of_gap(0.0011));
  scene.turn_to(q_of_gap(-1e-6));
  EXPECT_EQ(scene.monitor.count(), 2);
}

/// The balls of a part may reach into what the part does not touch.
TEST(Collisions, PartsDecideForTheirBalls) {
  kin::ArmModel thin = arm();
  kin::SafetyBall& ball = thin.balls[1];
  kin::SafetyPart rod;
  rod.frame = ball.frame;
  rod.group = ball.group;
  rod.shape.points.resize(2, 3);
  rod.shape.points.row(0) = rod.shape.points.row(1) = ball.center.transpose();
  rod.shape.points(0, 2) -= 0.5 * ball.radius;
  rod.shape.points(1, 2) += 0.5 * ball.radius;
  rod.cover = {{ball.center, ball.radius}};
  ball.of_part = true;
  thin.parts = {rod};
  CollisionMonitor monitor(thin, table());
  std::vector<Eigen::Isometry3d> X;
  const auto turn_to = [&](double q) {
    kin::forward(thin, Eigen::VectorXd::Constant(1, q), X);
    monitor.update(X, object());
  };
  turn_to(std::acos(0.14 / 0.5));  // the ball is in the shelf, the rod 90 mm beside it
  EXPECT_EQ(monitor.count(), 0);
  turn_to(std::acos(0.04 / 0.5));
  EXPECT_EQ(monitor.count(), 1);
}

TEST(Collisions, AllBallsOfTheBarAreOneBody) {
  Scene scene;
  scene.turn_to(-M_PI / 2);
  EXPECT_EQ(scene.monitor.count(), 1);
  EXPECT_EQ(scene.monitor.last(), "hand ball 2 with bar");
}

TEST(Collisions, SelfContactsCount) {
  kin::ArmModel folded = arm();
  folded.links[0].a = 0.1;  // the hand inside the base
  CollisionMonitor monitor(folded, {});
  std::vector<Eigen::Isometry3d> X;
  kin::forward(folded, Eigen::VectorXd::Zero(1), X);
  monitor.update(X, object());
  EXPECT_EQ(monitor.count(), 1);
  EXPECT_EQ(monitor.last(), "base ball 0 with hand ball 2");
}

TEST(Collisions, TheHeldObjectIsPartOfTheHand) {
  Scene scene;
  ObjectInScene held =
      object({0.0, 0.595, 0.5 + 0.06 - 0.002});  // 2 mm deep in the top of the shelf
  held.held = true;
  scene.turn_to(0.0, held);
  EXPECT_EQ(scene.monitor.count(), 0);
  held.cylinder.X_WO.translation().z() -= 0.002;  // 4 mm: more than resting on it
  scene.turn_to(0.0, held);
  EXPECT_EQ(scene.monitor.count(), 1);
  EXPECT_EQ(scene.monitor.last(), "object with shelf");
}

TEST(Collisions, OnlyTheHandMayTouchTheObjectAndOnlyBetweenTheFingers) {
  Scene scene;
  ObjectInScene between = object({1.0, 0.0, 0.0});
  between.between_fingers = true;
  scene.turn_to(0.0, between);
  EXPECT_EQ(scene.monitor.count(), 0);
  EXPECT_EQ(scene.monitor.push().depth, 0.0);

  scene.turn_to(0.0, object({1.06, 0.0, 0.0}));
  EXPECT_EQ(scene.monitor.count(), 1);
  EXPECT_EQ(scene.monitor.last(), "hand ball 2 with object");
  EXPECT_EQ(scene.monitor.push().name, "hand ball 2");
  EXPECT_NEAR(scene.monitor.push().depth, 0.05 + 0.02 - 0.06, 1e-12);

  ObjectInScene at_the_forearm = object({0.5, 0.11, 0.0});
  at_the_forearm.between_fingers = true;
  scene.turn_to(0.0, at_the_forearm);
  EXPECT_EQ(scene.monitor.last(), "fore ball 1 with object");
}

TEST(Collisions, AFallingObjectBlamesNobody) {
  Scene scene;
  ObjectInScene falling = object({1.06, 0.0, 0.0});
  falling.falling = true;
  scene.turn_to(0.0, falling);
  EXPECT_EQ(scene.monitor.count(), 0);
}

const kin::Box kBox{{1.0, 0.0, 0.0}, {0.1, 0.2, 0.3}, "box"};

Cylinder cylinder(double lean = 0.0) {
  Cylinder c{.radius = 0.02, .height = 0.12};
  c.X_WO = Eigen::Translation3d(0.5, 0.0, 0.3) * Eigen::AngleAxisd(lean, Eigen::Vector3d::UnitX());
  return c;
}

TEST(SignedDistance, OfABoxFromFaceEdgeCornerAndInside) {
  EXPECT_NEAR(signed_distance(kBox, {1.25, 0.0, 0.0}), 0.15, 1e-12);
  EXPECT_NEAR(signed_distance(kBox, {1.13, 0.24, 0.0}), 0.05, 1e-12);
  EXPECT_NEAR(signed_distance(kBox, {1.1 + 0.02, 0.2 + 0.03, 0.3 + 0.06}), 0.07, 1e-12);
  EXPECT_NEAR(signed_distance(kBox, {1.08, 0.0, 0.0}), -0.02, 1e-12);
}

TEST(SignedDistance, OfACylinderFromSideEndRimAndInside) {
  EXPECT_NEAR(signed_distance(cylinder(), {0.55, 0.0, 0.3}), 0.03, 1e-12);
  EXPECT_NEAR(signed_distance(cylinder(), {0.5, 0.01, 0.40}), 0.04, 1e-12);
  EXPECT_NEAR(signed_distance(cylinder(), {0.52 + 0.03, 0.0, 0.36 + 0.04}), 0.05, 1e-12);
  EXPECT_NEAR(signed_distance(cylinder(), {0.5, 0.0, 0.355}), -0.005, 1e-12);
  EXPECT_NEAR(signed_distance(cylinder(M_PI / 2), {0.5, 0.06 + 0.01, 0.3}), 0.01,
              1e-12);  // lies along y
}

TEST(CylinderPosture, TiltAndLowestPoint) {
  EXPECT_NEAR(tilt(cylinder()), 0.0, 1e-12);
  EXPECT_NEAR(tilt(cylinder(0.3)), 0.3, 1e-12);
  EXPECT_NEAR(tilt(cylinder(M_PI - 0.3)), 0.3, 1e-12);  // upside down is as good
  EXPECT_NEAR(lowest_point(cylinder()), 0.24, 1e-12);
  EXPECT_NEAR(lowest_point(cylinder(M_PI / 2)), 0.28, 1e-12);
  EXPECT_NEAR(lowest_point(cylinder(0.5)), 0.3 - 0.06 * std::cos(0.5) - 0.02 * std::sin(0.5),
              1e-12);
}

TEST(CoveringBalls, TouchTheSurfaceFromInside) {
  const Cylinder c = cylinder(0.4);
  for (const kin::Ball& ball : covering_balls(c)) {
    EXPECT_NEAR(signed_distance(c, ball.center) + ball.radius, 0.0, 1e-9);
  }
  double lowest = INFINITY;
  for (const kin::Ball& ball : covering_balls(c))
    lowest = std::min(lowest, ball.center.z() - ball.radius);
  EXPECT_NEAR(lowest, lowest_point(c), 0.02 * (1 - std::cos(M_PI / 12)) * std::sin(0.4) + 1e-12);
}

}  // namespace
}  // namespace mimesis::world
