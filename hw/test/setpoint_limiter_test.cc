#include "hw/setpoint_limiter.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/testing/no_malloc.h"

namespace mimesis::hw {
namespace {

constexpr double kT = 0.005, kV = 2.0, kA = 10.0, kEnd = 1.5;

SetpointLimiter limiter() {
  const auto v = [](double x) { return Eigen::VectorXd::Constant(1, x); };
  return {{.q_min = v(-kEnd), .q_max = v(kEnd), .v_max = v(kV), .a_max = v(kA)}, kT};
}

/// Follows q(t) for `seconds` and checks in every cycle what must never be exceeded.
template <class F>
int run(SetpointLimiter& limiter, double seconds, F q) {
  int limited = 0;
  for (int k = 1; k <= std::lround(seconds / kT); ++k) {
    const double before = limiter.position()[0], v = limiter.velocity()[0];
    const double target = q(k * kT);
    limited += limiter.follow(std::span(&target, 1)) ? 1 : 0;
    const double v_now = (limiter.position()[0] - before) / kT;
    EXPECT_LE(std::abs(v_now), kV + 1e-9) << k;
    EXPECT_LE(std::abs(v_now - v), kA * kT + 1e-9) << k;
    EXPECT_LE(std::abs(limiter.position()[0]), kEnd) << k;
  }
  return limited;
}

TEST(SetpointLimiter, PassesWhatIsWithinTheLimits) {
  SetpointLimiter l = limiter();
  l.reset(std::array{0.0});
  const auto q = [](double t) { return 0.3 * (1.0 - std::cos(4.0 * t)); };  // |v| ≤ 1.2, |a| ≤ 4.8
  EXPECT_EQ(run(l, 3.0, q), 0);
  EXPECT_NEAR(l.position()[0], q(3.0), 1e-12);
}

TEST(SetpointLimiter, AStepIsReachedInTheShortestTimeWithoutOvershoot) {
  SetpointLimiter l = limiter();
  l.reset(std::array{0.0});
  const double step = 1.0, time = kV / kA + step / kV;  // trapezoid: 0.7 s
  double highest = 0.0;
  run(l, time + 6 * kT, [&](double) {
    highest = std::max(highest, l.position()[0]);
    return step;
  });
  EXPECT_NEAR(l.position()[0], step, 1e-3);
  EXPECT_LE(highest, step + 1e-12);
}

TEST(SetpointLimiter, StopsAtTheEndOfTheJoint) {
  SetpointLimiter l = limiter();
  l.reset(std::array{0.0});
  EXPECT_GT(run(l, 3.0, [](double t) { return 1.9 * t; }), 0);
  EXPECT_NEAR(l.position()[0], kEnd, 1e-6);
}

TEST(SetpointLimiter, StartsWithoutAJumpEvenBeyondTheEnd) {
  SetpointLimiter l = limiter();
  l.reset(std::array{kEnd + 0.1});
  double before = l.position()[0];
  for (int k = 0; k < 400; ++k) {
    const double target = kEnd + 0.1;
    l.follow(std::span(&target, 1));
    EXPECT_LE(l.position()[0], before);
    EXPECT_LE(before - l.position()[0], kV * kT + 1e-9);
    before = l.position()[0];
  }
  EXPECT_NEAR(before, kEnd, 1e-6);
}

TEST(SetpointLimiter, CatchesUpWithAMovingTarget) {
  SetpointLimiter l = limiter();
  l.reset(std::array{-1.0});
  run(l, 1.5, [](double t) { return -0.8 + 0.5 * t; });
  EXPECT_NEAR(l.position()[0], -0.8 + 0.75, 1e-9);
  EXPECT_NEAR(l.velocity()[0], 0.5, 1e-9);
}

TEST(SetpointLimiter, HoldsByBoundedDeceleration) {
  SetpointLimiter l = limiter();
  l.reset(std::array{0.0});
  run(l, 0.5, [](double t) { return 0.5 * kA * 0.4 * t * t; });  // ends at 2 rad/s · 1 = a·t
  const double v = l.velocity()[0], start = l.position()[0];
  ASSERT_GT(v, 1.0);
  const int cycles = static_cast<int>(std::ceil(v / (kA * kT)));
  for (int k = 0; k < cycles; ++k) l.hold();
  EXPECT_EQ(l.velocity()[0], 0.0);
  EXPECT_NEAR(l.position()[0] - start, v * v / (2 * kA), v * kT);
}

TEST(SetpointLimiter, DoesNotAllocate) {
  SetpointLimiter l = limiter();
  const std::array q{0.4};
  l.reset(q);
  testing::NoMalloc guard;
  for (int i = 0; i < 1000; ++i) l.follow(q);
  l.hold();
}

TEST(SetpointLimiter, GoesOnWhereTheDrivesHaveGone) {
  SetpointLimiter l = limiter();
  l.reset(std::array{0.0});
  const auto q = [](double t) { return 0.3 * (1.0 - std::cos(4.0 * t)); };
  run(l, 0.4, q);  // almost at its fastest
  const double v = l.velocity()[0];
  l.coast(3);
  EXPECT_NEAR(l.position()[0], q(0.4) + 3 * kT * v, 1e-12);
  const double target = q(0.4 + 4 * kT);
  l.follow(std::span(&target, 1));
  EXPECT_NEAR(l.position()[0], target, 1e-12);
  EXPECT_NEAR(l.velocity()[0], v, kA * kT);
}

}  // namespace
}  // namespace mimesis::hw
