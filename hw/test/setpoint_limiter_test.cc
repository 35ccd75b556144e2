#include "hw/setpoint_limiter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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

/// With a limit of the jerk, drawn limits and cycles.
struct Drawn {
  explicit Drawn(unsigned seed) : random(seed) {
    dt = std::array{0.001, 0.002, 0.005, 0.01}[random() % 4];
    v_max = uniform(0.2, 4.0);
    a_max = uniform(1.0, 30.0);
    j_max = std::min(uniform(5.0, 200.0) * a_max, a_max / dt);
  }
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(random()) / 4294967296.0;
  }
  SetpointLimiter limiter(double end = kEnd) const {
    const auto v = [](double x) { return Eigen::VectorXd::Constant(1, x); };
    SetpointLimiter l({.q_min = v(-end),
                       .q_max = v(end),
                       .v_max = v(v_max),
                       .a_max = v(a_max),
                       .j_max = v(j_max)},
                      dt);
    l.reset(std::array{0.0});
    return l;
  }
  std::mt19937 random;
  double dt, v_max, a_max, j_max;
};

TEST(Jerk, NoStreamMakesItExceedALimit) {
  for (unsigned seed = 1; seed <= 200; ++seed) {
    Drawn d(seed);
    SetpointLimiter l = d.limiter();
    double centre = 0.0, v = 0.0, a = 0.0;
    for (int k = 0; k < 800; ++k) {
      if (d.random() % 50 == 0) centre = d.uniform(-2.0, 2.0);
      const double target = centre + (seed % 2 == 0 ? 0.3 * std::sin(3.0 * k * d.dt) : 0.0);
      const double q = l.position()[0];
      l.follow(std::span(&target, 1));
      const double v_now = (l.position()[0] - q) / d.dt, a_now = (v_now - v) / d.dt;
      ASSERT_LE(std::abs(l.position()[0]), kEnd) << seed;
      ASSERT_LE(std::abs(v_now), d.v_max * (1.0 + 1e-9)) << seed;
      // The end of the joint comes before comfort.
      const bool at_end = kEnd - std::abs(l.position()[0]) < d.v_max * d.dt;
      ASSERT_LE(std::abs(a_now), d.a_max * (at_end ? 1.1 : 1.0 + 1e-6)) << seed;
      ASSERT_LE(std::abs(a_now - a), d.j_max * d.dt * (1.0 + 1e-6) + (at_end ? d.a_max : 0.0))
          << seed << " " << k;
      v = v_now;
      a = a_now;
    }
  }
}

/// The shortest time from rest to rest over D, when acceleration and velocity are reached:
/// D/v + v/a + a/j.
TEST(Jerk, AStepTakesAlmostTheShortestTime) {
  for (unsigned seed = 1; seed <= 50; ++seed) {
    Drawn d(seed);
    d.v_max = std::max(d.v_max, d.a_max * d.a_max / d.j_max);
    const double step = d.v_max * (d.v_max / d.a_max + d.a_max / d.j_max) + 1.0;
    SetpointLimiter l = d.limiter(step + 1.0);
    const double time = step / d.v_max + d.v_max / d.a_max + d.a_max / d.j_max;
    double highest = 0.0, reached = 0.0;
    for (int k = 1; k * d.dt < 2.0 * time; ++k) {
      l.follow(std::span(&step, 1));
      highest = std::max(highest, l.position()[0]);
      if (std::abs(l.position()[0] - step) > 1e-3) reached = k * d.dt;
    }
    EXPECT_GE(reached, 0.85 * time) << seed << " faster than the limits allow";
    EXPECT_LE(reached, 1.1 * time + 6 * d.dt) << seed;
    EXPECT_LE(highest, step + 1e-3 * step) << seed;
    EXPECT_NEAR(l.position()[0], step, 1e-6) << seed;
  }
}

/// q = 0.6 t − 0.15 sin 4t: velocity 0.6 (1 − cos 4t), acceleration 2.4 sin 4t, jerk 9.6 cos 4t.
TEST(Jerk, PassesWhatIsWithinTheLimits) {
  Drawn d(1);
  d.dt = kT, d.v_max = 1.2, d.a_max = 2.4, d.j_max = 9.6;
  SetpointLimiter l = d.limiter(100.0);
  for (int k = 1; k < 2000; ++k) {
    const double t = k * kT, target = 0.6 * t - 0.15 * std::sin(4.0 * t);
    ASSERT_FALSE(l.follow(std::span(&target, 1))) << k;
  }
}

TEST(Jerk, CatchesUpWithAStreamThatTurns) {
  Drawn d(1);
  d.dt = kT, d.v_max = 1.5, d.a_max = 8.0, d.j_max = 200.0;
  for (const double rate : {2.0, 3.0, 4.0}) {  // accelerations up to 3.2 rad/s²
    for (const double ahead : {-0.4, 0.1, 0.4}) {
      SetpointLimiter l = d.limiter();
      int late = 0;
      for (int k = 1; k < 1200; ++k) {
        const double target = ahead + 0.2 * std::sin(rate * k * kT);
        l.follow(std::span(&target, 1));
        if (std::abs(l.position()[0] - target) > 1e-9) late = k;
      }
      EXPECT_LE(late * kT, 1.0) << rate << " " << ahead;
    }
  }
}

TEST(Jerk, DoesNotDelayAStop) {
  Drawn d(1);
  d.dt = kT, d.v_max = 2.0, d.a_max = 10.0, d.j_max = 50.0;
  for (const bool on_path : {false, true}) {
    SetpointLimiter l = d.limiter(3.0);
    double target = 0.0, v = 0.0;
    for (int k = 0; k < 200; ++k) {
      v = std::min(v + 2.0 * kT, 1.0);
      target += v * kT;
      l.follow(std::span(&target, 1));
    }
    ASSERT_NEAR(l.velocity()[0], 1.0, 1e-6);
    for (int k = 1; k <= 20; ++k) {  // at 10 rad/s² it takes 0.1 s
      target += std::max(0.0, 1.0 - 10.0 * k * kT) * kT;
      on_path ? (void)l.follow(std::span(&target, 1), true) : l.hold();
      EXPECT_NEAR(l.velocity()[0], std::max(0.0, 1.0 - 10.0 * k * kT), 1e-9) << k;
    }
  }
}

TEST(Jerk, DoesNotAllocate) {
  SetpointLimiter l = Drawn(3).limiter();
  testing::NoMalloc guard;
  for (int i = 0; i < 1000; ++i) {
    const double target = i % 100 < 50 ? 1.0 : -1.0;
    l.follow(std::span(&target, 1));
  }
}

}  // namespace
}  // namespace mimesis::hw
