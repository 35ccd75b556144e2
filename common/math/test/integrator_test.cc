#include "common/math/integrator.h"

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
  Vector2d x(1.0, 0.0);
  for (int n = 0; n < steps; ++n) x = rk4_step(swing, n * dt, x, dt);
  return (x - Vector2d(std::cos(std::sin(3.0)), std::sin(std::sin(3.0)))).norm();
}

TEST(Rk4, ConvergesWithOrderFour) {
  EXPECT_NEAR(std::log2(error_of(100) / error_of(200)), 4.0, 0.1);
  EXPECT_LT(error_of(200), 1e-8);
}

TEST(Rk4, DoesNotAllocateWithFixedStates) {
  Vector2d x(1.0, 0.0);
  const mimesis::testing::NoMalloc guard;
  for (int n = 0; n < 10; ++n) x = rk4_step(swing, 0.0, x, 0.01);
}

}  // namespace
}  // namespace mimesis::math
