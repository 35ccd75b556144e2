#include <gtest/gtest.h>

#include <cmath>

#include "hw/sim/world/collisions.h"

namespace mimesis::world {
namespace {

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
