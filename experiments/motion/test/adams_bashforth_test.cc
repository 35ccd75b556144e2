#include "experiments/motion/adams_bashforth.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "common/testing/no_malloc.h"

namespace mimesis::math {
namespace {

using Eigen::Vector2d;

// ẋ = cos t · J x: x(t) is x(0) turned by sin t. Time dependent, so that stages at wrong times
// show.
Vector2d swing(double t, const Vector2d& x) { return std::cos(t) * Vector2d(-x[1], x[0]); }

double error_of(int steps) {
  const double dt = 3.0 / steps;
  AdamsBashforth5<Vector2d> ab(dt);
  Vector2d x(1.0, 0.0);
  for (int n = 0; n < steps; ++n) ab.step(swing, n * dt, x);
  return (x - Vector2d(std::cos(std::sin(3.0)), std::sin(std::sin(3.0)))).norm();
}

TEST(AdamsBashforth5, ConvergesWithOrderFive) {
  EXPECT_NEAR(std::log2(error_of(400) / error_of(800)), 5.0, 0.2);
  EXPECT_LT(error_of(400), 1e-9);
}

TEST(AdamsBashforth5, IsExactForPolynomialsOfDegreeFiveAndStartsByRk4) {
  AdamsBashforth5<double> ab(0.5);
  double x = 0.0;
  auto quartic = [](double t, double) { return 5.0 * t * t * t * t; };
  double by_rk4 = 0.0;
  for (int n = 0; n < 4; ++n) {
    ab.step(quartic, 0.5 * n, x);
    by_rk4 = rk4_step(quartic, 0.5 * n, by_rk4, 0.5);
  }
  EXPECT_EQ(x, by_rk4);
  x = 32.0;  // t = 2
  for (int n = 4; n < 10; ++n) ab.step(quartic, 0.5 * n, x);
  EXPECT_NEAR(x, std::pow(5.0, 5), 1e-9);
  ab.restart();
  const double start = x;
  ab.step(quartic, 5.0, x);
  EXPECT_EQ(x, rk4_step(quartic, 5.0, start, 0.5));
}

TEST(AdamsBashforth5, DoesNotAllocateWithFixedStates) {
  AdamsBashforth5<Vector2d> ab(0.01);
  Vector2d x(1.0, 0.0);
  const mimesis::testing::NoMalloc guard;
  for (int n = 0; n < 10; ++n) ab.step(swing, 0.01 * n, x);
}

}  // namespace
}  // namespace mimesis::math
