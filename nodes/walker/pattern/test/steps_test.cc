// Closed forms below the generators: the cart-table, the feet's polynomials, the timing of steps.
#include "nodes/walker/pattern/steps.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nodes/walker/pattern/cart_table.h"
#include "nodes/walker/pattern/standing.h"
#include "nodes/walker/pattern/support_polygon.h"

namespace mimesis::walker {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const ComState kState{.p_W_m = {0.1, -0.2}, .v_W = {0.3, 0.4}, .a_W = {-0.5, 0.6}};
constexpr double kHeight_m = 0.8;

/// x(t + d) from x(t), the same as in one go; and its rates are those of the place.
template <class Flow>
void expect_flow(const Flow& flow) {
  const double t = 0.3, d = 1e-5;
  const ComState once = flow(kState, t), twice = flow(flow(kState, 0.1), t - 0.1);
  EXPECT_LT((once.p_W_m - twice.p_W_m).norm(), 1e-12);
  EXPECT_LT((once.v_W - twice.v_W).norm(), 1e-12);
  EXPECT_LT((once.a_W - twice.a_W).norm(), 1e-12);
  const ComState before = flow(kState, t - d), after = flow(kState, t + d);
  EXPECT_LT(((after.p_W_m - before.p_W_m) / (2.0 * d) - once.v_W).norm(), 1e-8);
  EXPECT_LT(((after.v_W - before.v_W) / (2.0 * d) - once.a_W).norm(), 1e-8);
}

TEST(CartTable, GoesByItsJerk) {
  const Vector2d jerk(2.0, -3.0);
  expect_flow([&](const ComState& x, double t) { return advance(x, jerk, t); });
  EXPECT_LT((advance(kState, jerk, 0.3).a_W - kState.a_W - 0.3 * jerk).norm(), 1e-15);
}

TEST(CartTable, IsAPendulumWhileItsZmpRests) {
  expect_flow([](const ComState& x, double t) { return with_zmp_at_rest(x, kHeight_m, t); });
  const ComState later = with_zmp_at_rest(kState, kHeight_m, 0.5);
  EXPECT_LT((zmp(later, kHeight_m) - zmp(kState, kHeight_m)).norm(), 1e-12);
  // p̈ = (g/h) (p − z)
  const Vector2d z = zmp(kState, kHeight_m);
  EXPECT_LT((kState.a_W - kGravity_m_s2 / kHeight_m * (kState.p_W_m - z)).norm(), 1e-12);
}

TEST(Standing, BringsAnyStateToRestWithoutSwingingOn) {
  const Standing standing(kHeight_m);
  const Vector2d middle(1.0, 2.0);
  ComState com{.p_W_m = middle + Vector2d(0.02, -0.01), .v_W = {0.0, 0.05}, .a_W = {0.1, 0.0}};
  double beyond_m = 0.0;
  for (int i = 0; i < 1000; ++i) {
    beyond_m = std::max(beyond_m, (zmp(com, kHeight_m) - middle).cwiseAbs().maxCoeff());
    com = standing.after(com, middle, 1);
    if (i == 399) {
      EXPECT_LT((com.p_W_m - middle).norm(), 1e-3);
    }
  }
  EXPECT_LT(beyond_m, 0.06);
  EXPECT_LT((com.p_W_m - middle).norm(), 1e-6);
}

TEST(Standing, IsSettledNearItsMiddleAndAtRest) {
  const Vector2d middle(1.0, 2.0);
  const auto settled = [&](double off_m, double m_s, double m_s2) {
    return Standing::settled(
        {.p_W_m = middle + Vector2d(off_m, 0.0), .v_W = {0.0, m_s}, .a_W = {m_s2, 0.0}}, middle);
  };
  EXPECT_TRUE(settled(0.014, 0.029, 0.19));
  EXPECT_FALSE(settled(0.016, 0.0, 0.0));
  EXPECT_FALSE(settled(0.0, 0.031, 0.0));
  EXPECT_FALSE(settled(0.0, 0.0, 0.21));
}

/// The polynomial of fifth degree of its ends: place, rate and acceleration, and rest beyond.
TEST(Quintic, MeetsBothEndsAndItsRatesAreThoseOfItsPlace) {
  const PlanarState from{.p = {0.1, 0.2, 0.3}, .v = {0.5, -0.4, 0.2}, .a = {-1.0, 2.0, 0.5}};
  const Vector3d goal(0.4, -0.1, 0.5);
  const double D = 0.6, d = 1e-5;
  EXPECT_LT((quintic(from, goal, D, 0.0).p - from.p).norm(), 1e-12);
  EXPECT_LT((quintic(from, goal, D, 0.0).v - from.v).norm(), 1e-12);
  EXPECT_LT((quintic(from, goal, D, 0.0).a - from.a).norm(), 1e-12);
  const PlanarState end = quintic(from, goal, D, D - 1e-9);
  EXPECT_LT((end.p - goal).norm(), 1e-7);
  EXPECT_LT(end.v.norm(), 1e-6);
  EXPECT_LT(end.a.norm(), 1e-5);
  EXPECT_EQ(quintic(from, goal, D, D + 0.1).p, goal);
  for (const double t : {0.1, 0.3, 0.5}) {
    const PlanarState now = quintic(from, goal, D, t), before = quintic(from, goal, D, t - d),
                      after = quintic(from, goal, D, t + d);
    EXPECT_LT(((after.p - before.p) / (2.0 * d) - now.v).norm(), 1e-7);
    EXPECT_LT(((after.v - before.v) / (2.0 * d) - now.a).norm(), 1e-6);
  }
}

/// Steps that walk, with landings ahead that turn and go.
Steps walking(Steps::Change change) {
  Steps steps(GaitSettings{}, change);
  steps.decide(true, kLeft, true);
  steps.plan(0, {.side = kLeft, .p_W_m = {0.2, 0.1}, .yaw_rad = 0.1});
  steps.plan(1, {.side = kRight, .p_W_m = {0.4, -0.1}, .yaw_rad = 0.2});
  steps.plan(2, {.side = kLeft, .p_W_m = {0.6, 0.1}, .yaw_rad = 0.3});
  return steps;
}

TEST(Steps, SupportIsBothFeetThenOneAfterTheOther) {
  const Steps steps = walking(Steps::Change::kAtOnce);
  const int first = 160, step = 160;  // 0.8 s each
  for (const auto& [ticks, both, foot] : {std::tuple{0, true, 0},
                                          {first, true, 0},
                                          {first + 1, false, 0},
                                          {first + step, false, 0},
                                          {first + step + 1, false, 1},
                                          {first + 2 * step, false, 1},
                                          {first + 2 * step + 1, false, 2}}) {
    const Support s = steps.support_after(ticks);
    EXPECT_EQ(s.both, both) << ticks;
    EXPECT_EQ(s.i, foot) << ticks;
    EXPECT_EQ(s.j, foot) << ticks;
    Steps later = steps;  // what is foreseen is what comes
    later.advance(ticks);
    if (!both) {
      EXPECT_EQ(later.support_after(1).i + (later.phase() == Steps::Phase::kStep ? foot : 0), foot);
    }
  }
}

TEST(Steps, AfterTheLastLandingBothFeetCarry) {
  Steps steps = walking(Steps::Change::kAtOnce);
  steps.advance(161);
  steps.decide(false, kLeft, true);
  EXPECT_EQ(steps.landings_left(), 2);
  const Support s = steps.support_after(2 * 160);
  EXPECT_EQ(s.i, 1);
  EXPECT_EQ(s.j, 2);
  steps.advance(2 * 160);
  EXPECT_EQ(steps.phase(), Steps::Phase::kSettle);
  steps.decide(false, kLeft, false);
  EXPECT_EQ(steps.phase(), Steps::Phase::kSettle);
  steps.decide(false, kLeft, true);
  EXPECT_EQ(steps.phase(), Steps::Phase::kStand);
}

TEST(Steps, ALateChangeOfMindWaitsForTheLandingUnlessItMayBeAtOnce) {
  for (const Steps::Change change : {Steps::Change::kAtOnce, Steps::Change::kAfterLanding}) {
    const bool at_once = change == Steps::Change::kAtOnce;
    Steps starts = walking(change);
    starts.advance(50);
    starts.decide(false, kLeft, false);
    EXPECT_EQ(starts.phase(), at_once ? Steps::Phase::kSettle : Steps::Phase::kStart);
    Steps stops = walking(change);
    stops.advance(161);
    stops.decide(false, kLeft, false);
    stops.advance(160);
    ASSERT_EQ(stops.landings_left(), 1);
    stops.decide(true, kLeft, false);
    EXPECT_EQ(stops.landings_left(), at_once ? -1 : 1);
  }
}

TEST(Steps, TellTimeAndRatesOfTheFeetAsTheyMove) {
  Steps steps = walking(Steps::Change::kAtOnce);
  PatternSample before;
  steps.describe(before);
  EXPECT_EQ(before.gait, Gait::kStarting);
  EXPECT_NEAR(before.to_landing_s, 1.6, 1e-12);
  steps.advance(1);
  double turned = 0.0;
  for (int tick = 1; tick < 600; ++tick) {
    PatternSample now;
    steps.describe(now);
    if (now.steps == before.steps) {
      EXPECT_NEAR(before.to_landing_s - now.to_landing_s, kTick_s, 1e-9) << tick;
      // Trapezoids: what constant acceleration in a tick does not explain.
      const double mean_rate = 0.5 * (before.yaw_rate_rad_s + now.yaw_rate_rad_s);
      EXPECT_NEAR(now.yaw_rad - before.yaw_rad, mean_rate * kTick_s, 2e-5) << tick;
      const FootState &a = before.foot[before.swing], &b = now.foot[before.swing];
      EXPECT_NEAR(b.yaw_rate_rad_s - a.yaw_rate_rad_s,
                  0.5 * (a.yaw_acceleration + b.yaw_acceleration) * kTick_s, 2e-3)
          << tick;
      turned = std::max(turned, std::abs(b.yaw_rate_rad_s));
    }
    EXPECT_NEAR(now.since_change_s, tick % 160 * kTick_s, 1e-12) << tick;
    before = now;
    steps.advance(1);
  }
  EXPECT_GT(turned, 0.1);
}

TEST(Steps, MoveAsAWhole) {
  const Steps steps = walking(Steps::Change::kAtOnce);
  const Vector2d by(0.03, -0.02);
  for (const int ticks : {0, 200, 300, 500}) {
    Steps a = steps, b = steps;
    a.advance(ticks);
    b.shift(by);
    b.advance(ticks);
    PatternSample s, t;
    a.describe(s);
    b.describe(t);
    EXPECT_LT((t.landing.p_W_m - s.landing.p_W_m - by).norm(), 1e-12);
    EXPECT_LT((b.middle_W_m() - a.middle_W_m() - by).norm(), 1e-12);
    for (const Side side : robot::kSides) {
      const Vector3d way = t.foot[side].X_WS.translation() - s.foot[side].X_WS.translation();
      EXPECT_LT((way.head<2>() - by).norm(), 1e-12);
    }
  }
}

TEST(SupportPolygon, HoldsBothSolesAndNothingMore) {
  const Vector2d half(0.06, 0.03);
  const Footprint left{.side = kLeft, .p_W_m = {0.3, 0.2}, .yaw_rad = 0.4},
      right{.side = kRight, .p_W_m = {0.0, 0.0}, .yaw_rad = -0.3};
  std::vector<HalfPlane> sides;
  support_polygon(left, right, half, sides);
  ASSERT_GE(sides.size(), 4U);
  std::vector<Vector2d> corners;
  for (const Footprint& foot : {left, right}) {
    for (const double x : {-1.0, 1.0}) {
      for (const double y : {-1.0, 1.0}) {
        corners.push_back(foot.p_W_m + rotation(foot.yaw_rad) * Vector2d(x, y).cwiseProduct(half));
      }
    }
  }
  for (const HalfPlane& side : sides) {
    EXPECT_NEAR(side.normal.norm(), 1.0, 1e-12);
    int on_it = 0;
    for (const Vector2d& corner : corners) {
      const double beyond = side.normal.dot(corner) - side.offset;
      EXPECT_LT(beyond, 1e-12);
      on_it += beyond > -1e-9;
    }
    EXPECT_EQ(on_it, 2);
  }
}

}  // namespace
}  // namespace mimesis::walker
