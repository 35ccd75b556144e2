#include "nodes/walker/pattern/steps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "nodes/walker/pattern/mpc_problem.h"
#include "nodes/walker/pattern/preview_control.h"

namespace mimesis::walker {

// Closed forms below the generators: the cart-table, the feet's polynomials, the timing of steps.
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
  const Steps steps = walking(Steps::Change::at_once);
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
    Steps later = steps;  // the prediction equals the later state
    later.advance(ticks);
    if (!both) {
      EXPECT_EQ(later.support_after(1).i + (later.phase() == Steps::Phase::step ? foot : 0), foot);
    }
  }
}

TEST(Steps, AfterTheLastLandingBothFeetCarry) {
  Steps steps = walking(Steps::Change::at_once);
  steps.advance(161);
  steps.decide(false, kLeft, true);
  EXPECT_EQ(steps.landings_left(), 2);
  const Support s = steps.support_after(2 * 160);
  EXPECT_EQ(s.i, 1);
  EXPECT_EQ(s.j, 2);
  steps.advance(2 * 160);
  EXPECT_EQ(steps.phase(), Steps::Phase::settle);
  steps.decide(false, kLeft, false);
  EXPECT_EQ(steps.phase(), Steps::Phase::settle);
  steps.decide(false, kLeft, true);
  EXPECT_EQ(steps.phase(), Steps::Phase::stand);
}

TEST(Steps, ALateChangeOfMindWaitsForTheLandingUnlessItMayBeAtOnce) {
  for (const Steps::Change change : {Steps::Change::at_once, Steps::Change::after_landing}) {
    const bool at_once = change == Steps::Change::at_once;
    Steps starts = walking(change);
    starts.advance(50);
    starts.decide(false, kLeft, false);
    EXPECT_EQ(starts.phase(), at_once ? Steps::Phase::settle : Steps::Phase::start);
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
  Steps steps = walking(Steps::Change::at_once);
  PatternSample before;
  steps.describe(before);
  EXPECT_EQ(before.gait, Gait::starting);
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
  const Steps steps = walking(Steps::Change::at_once);
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

namespace {

constexpr int kSteps = 2000;
constexpr double kStep = 1.0 / kSteps;

TEST(SwingHeight, BeginsAndEndsAtRestOnTheGround) {
  for (const double u : {-0.1, 0.0, 1.0, 1.1}) {
    EXPECT_EQ(swing_height(u).z, 0.0) << u;
    EXPECT_EQ(swing_height(u).dz, 0.0) << u;
  }
  EXPECT_EQ(swing_height(0.0).ddz, 0.0);
}

TEST(SwingHeight, RatesAreThoseOfTheHeight) {
  for (int i = 1; i < kSteps; ++i) {
    const double u = i * kStep, d = 1e-5;
    const SwingHeight before = swing_height(u - d), now = swing_height(u),
                      after = swing_height(u + d);
    EXPECT_NEAR((after.z - before.z) / (2.0 * d), now.dz, 1e-4) << u;
    EXPECT_NEAR((after.dz - before.dz) / (2.0 * d), now.ddz, 2e-2) << u;
  }
}

TEST(SwingHeight, GoesUpOnceAndDownOnceAndReachesItsHeight) {
  double highest = 0.0;
  int turns = 0;
  for (int i = 1; i < kSteps; ++i) {
    const SwingHeight now = swing_height(i * kStep);
    highest = std::max(highest, now.z);
    EXPECT_GT(now.z, 0.0) << i;
    turns += (now.dz > 0.0) != (swing_height((i + 1) * kStep).dz > 0.0);
  }
  EXPECT_NEAR(highest, 1.0, 1e-4);
  EXPECT_EQ(turns, 1);
}

TEST(SwingHeight, IsSlowerThanAPlainSwingWhereItMayTouchEarly) {
  int looked_at = 0;
  for (int i = kSteps / 2; i < kSteps; ++i) {
    const double u = i * kStep, w = u * (1.0 - u), plain = 64.0 * w * w * w;
    if (plain < 0.04 || plain > 0.1) continue;
    const double plain_speed = 64.0 * 3.0 * w * w * (2.0 * u - 1.0);
    for (int j = kSteps / 2; j < kSteps; ++j) {  // where the glide is as high
      const SwingHeight now = swing_height(j * kStep);
      if (std::abs(now.z - plain) > 2e-4) continue;
      EXPECT_LT(-now.dz, 0.61 * plain_speed) << plain;
      ++looked_at;
    }
  }
  EXPECT_GT(looked_at, 20);
}

TEST(SwingHeight, FootIsAtItsPlaceWhileItGlides) {
  const GaitSettings gait;
  Steps steps(gait, Steps::Change::at_once);
  steps.decide(true, kLeft, true);
  Footprint landing = steps.ground()[kLeft];
  landing.p_W_m.x() += 0.4;
  const double swing_s = gait.step_s - gait.double_support_s;
  int gliding = 0;
  for (int tick = 0; tick < 400 && steps.swing() == kLeft; ++tick) {
    steps.plan(0, landing);
    PatternSample sample;
    steps.describe(sample);
    const double left_s = sample.to_landing_s,
                 to_go_m = landing.p_W_m.x() - sample.foot[kLeft].X_WS.translation().x();
    if (steps.phase() == Steps::Phase::step && left_s < 0.95 * swing_s / 7.0) {
      EXPECT_NEAR(to_go_m, 0.0, 1e-12) << left_s;
      ++gliding;
    } else if (left_s > 1.3 * swing_s / 7.0) {
      EXPECT_GT(to_go_m, 1e-4) << left_s;
    }
    steps.advance(1);
  }
  EXPECT_GT(gliding, 10);
}

}  // namespace

namespace {

using Eigen::Vector2d;

const GaitSettings kGait;
const Footsteps kFootsteps{kGait};

FeasibleWish walk(double forward, double left, double turn) {
  FeasibleWish wish;
  wish.walk = true;
  wish.velocity_m_s = {forward, left};
  wish.yaw_rate_rad_s = turn;
  return wish;
}

/// Seen from a left foot that stands, mirrored for a right one: outward is positive.
Vector2d outward(Side swing, double forward_m, double outward_m) {
  return {forward_m, robot::sign(swing) * outward_m};
}

TEST(FirstSwing, IsTheFootOfTheLandingElseTheOneOnTheSideOfTheWay) {
  EXPECT_EQ(first_swing(walk(0.2, 0.0, 0.0)), kLeft);
  EXPECT_EQ(first_swing(walk(0.2, 0.1, -0.1)), kLeft);
  EXPECT_EQ(first_swing(walk(0.2, -0.1, 0.1)), kRight);
  EXPECT_EQ(first_swing(walk(0.2, 0.0, 0.1)), kLeft);
  EXPECT_EQ(first_swing(walk(0.2, 0.0, -0.1)), kRight);
  FeasibleWish wish = walk(0.2, 0.1, 0.0);
  wish.landing[0] = Footprint{.side = kRight};
  EXPECT_EQ(first_swing(wish), kRight);
}

TEST(Footsteps, MayLandInThePolygonOfTheSettings) {
  const double far = kGait.longest_step_m, wide = kGait.widest_step_m;
  for (const Side swing : robot::kSides) {
    for (const double ahead : {-1.0, 1.0}) {
      for (const auto& [x, y] : {std::pair{far, kGait.narrowest_step_m},
                                 {5.0 / 7.0 * far, wide},
                                 {0.0, 4.0 / 3.0 * wide}}) {
        const Vector2d corner = outward(swing, ahead * x, y), inside = outward(swing, 0.0, 0.2);
        EXPECT_NEAR(kFootsteps.beyond(swing, corner), 0.0, 1e-12);
        EXPECT_LT(kFootsteps.beyond(swing, inside + 0.99 * (corner - inside)), 0.0);
        EXPECT_GT(kFootsteps.beyond(swing, inside + 1.01 * (corner - inside)), 0.0);
      }
    }
    EXPECT_NEAR(kFootsteps.beyond(swing, outward(swing, 0.0, 0.15)), kGait.narrowest_step_m - 0.15,
                1e-12);
  }
}

/// The pelvis is beside the foot that stands, half of the feet's distance to the other one's side.
TEST(Footsteps, TheVelocityMovesThePelvisInTheMeanHeading) {
  for (const Side swing : robot::kSides) {
    for (const auto& [from, to] : {std::pair{0.0, 0.0}, {0.3, 0.45}, {-2.0, -2.1}}) {
      const Vector2d half = outward(swing, 0.0, 0.5 * kGait.feet_distance_m), v(0.25, 0.0);
      const Vector2d step = kFootsteps.step_W_m(swing, from, to, v), before = rotation(from) * half,
                     after = step - rotation(to) * half;
      EXPECT_LT((after - before - rotation(0.5 * (from + to)) * v * kGait.step_s).norm(), 1e-12);
    }
  }
}

/// Sideways one step is long, the other one short: not shorter than the feet need, 4 mm free, nor
/// longer.
TEST(Footsteps, SidewaysTheFeetAreAsFarApartAsTheyNeed) {
  for (const double speed : {0.01, 0.03, 0.1, 0.15}) {
    for (const Side way : robot::kSides) {
      const Vector2d v(0.0, robot::sign(way) * speed);
      const double goes = kFootsteps.step_W_m(way, 0.0, 0.0, v).y() * robot::sign(way),
                   follows =
                       -kFootsteps.step_W_m(robot::other(way), 0.0, 0.0, v).y() * robot::sign(way);
      EXPECT_NEAR(goes - follows, 2.0 * speed * kGait.step_s, 1e-12);
      EXPECT_NEAR(
          follows,
          std::max(kGait.feet_distance_m - speed * kGait.step_s, kGait.narrowest_step_m + 0.004),
          1e-12);
    }
  }
}

TEST(Footsteps, AFootTurnsTheShortWayAndNoFurtherThanItMay) {
  const double most = kGait.most_foot_yaw_rad;
  EXPECT_NEAR(kFootsteps.reachable_yaw(1.0, 1.1), 1.1, 1e-12);
  EXPECT_NEAR(kFootsteps.reachable_yaw(1.0, 2.0), 1.0 + most, 1e-12);
  EXPECT_NEAR(kFootsteps.reachable_yaw(1.0, 0.0), 1.0 - most, 1e-12);
  EXPECT_NEAR(kFootsteps.reachable_yaw(3.1, -3.1), 3.1 + 2.0 * std::numbers::pi - 6.2, 1e-12);
  EXPECT_NEAR(kFootsteps.reachable_yaw(3.1, -2.0), 3.1 + most, 1e-12);
}

TEST(Footsteps, ALandingOutOfReachIsTheLastPointOnTheWayThatIsNot) {
  for (const double yaw : {0.0, 1.2}) {
    const Footprint stance{.side = kRight, .p_W_m = {5.0, -3.0}, .yaw_rad = yaw};
    const Vector2d still = kFootsteps.beside(stance).p_W_m;
    EXPECT_LT((still - stance.p_W_m - rotation(yaw) * Vector2d(0.0, kGait.feet_distance_m)).norm(),
              1e-12);
    for (const Vector2d& way_S :
         {Vector2d(1.0, 0.1), Vector2d(-0.7, 0.6), Vector2d(0.1, -0.8), Vector2d(0.05, 0.02)}) {
      const Vector2d way = rotation(yaw) * way_S;
      const Footprint landing{.side = kLeft, .p_W_m = still + way, .yaw_rad = yaw + 0.5};
      const Footprint got = kFootsteps.reachable(stance, landing);
      EXPECT_EQ(got.side, kLeft);
      EXPECT_NEAR(got.yaw_rad, yaw + kGait.most_foot_yaw_rad, 1e-12);
      const Vector2d done = got.p_W_m - still;
      EXPECT_NEAR(done.dot(way), done.norm() * way.norm(), 1e-12) << "not on the way";
      const double beyond = kFootsteps.beyond(kLeft, rotation(-yaw) * (got.p_W_m - stance.p_W_m));
      if (way.norm() < 0.1) {
        EXPECT_LT((done - way).norm(), 1e-12);
      } else {
        EXPECT_NEAR(beyond, 0.0, 1e-12);
      }
    }
  }
}

TEST(Footsteps, CutsAWishThatDoesNotTurnToAWalkOfItsDirection) {
  for (const Vector2d& v : {Vector2d(0.35, 0.15), Vector2d(-0.35, 0.1), Vector2d(0.3, -0.15)}) {
    PatternTrouble trouble;
    Wish wish;
    wish.velocity_m_s = v;
    const FeasibleWish cut = kFootsteps.feasible(wish, trouble);
    EXPECT_TRUE(trouble.clipped);
    EXPECT_NEAR(cut.velocity_m_s.dot(v), cut.velocity_m_s.norm() * v.norm(), 1e-12);
    double beyond = -1.0;  // excess of the worse foot
    for (const Side side : robot::kSides) {
      const Footprint next = kFootsteps.next({.side = side}, cut);
      beyond = std::max(beyond, kFootsteps.beyond(next.side, next.p_W_m));
    }
    EXPECT_LT(beyond, 1e-12) << v.transpose();
    EXPECT_GT(beyond, -0.01) << v.transpose();
  }
}

TEST(Footsteps, SaysWhatItCutsAndLeavesTheRest) {
  const auto clipped = [](double forward, double left, double turn) {
    PatternTrouble trouble;
    Wish wish;
    wish.velocity_m_s = {forward, left};
    wish.yaw_rate_rad_s = turn;
    const FeasibleWish cut = kFootsteps.feasible(wish, trouble);
    EXPECT_EQ(trouble.clipped, (cut.velocity_m_s - wish.velocity_m_s).norm() > 0.0 ||
                                   cut.yaw_rate_rad_s != wish.yaw_rate_rad_s);
    return trouble.clipped;
  };
  EXPECT_FALSE(clipped(kGait.most_forward_m_s, 0.0, 0.0));
  EXPECT_FALSE(clipped(0.1, 0.0, kGait.most_turn_rad_s));
  EXPECT_FALSE(clipped(0.1, 0.05, 0.0));
  EXPECT_TRUE(clipped(kGait.most_forward_m_s + 0.01, 0.0, 0.0));
  EXPECT_TRUE(clipped(0.0, -kGait.most_sideways_m_s - 0.01, 0.0));
  EXPECT_TRUE(clipped(0.0, 0.0, -kGait.most_turn_rad_s - 0.01));
  PatternTrouble trouble;
  Wish wish;
  wish.landing[0] = Footprint{.side = kLeft, .p_W_m = {NAN, 0.0}, .yaw_rad = 0.0};
  wish.landing[1] = Footprint{.side = kRight, .p_W_m = {0.2, -0.1}, .yaw_rad = 0.1};
  const FeasibleWish cut = kFootsteps.feasible(wish, trouble);
  EXPECT_FALSE(cut.landing[0]);
  ASSERT_TRUE(cut.landing[1]);
  EXPECT_EQ(cut.landing[1]->yaw_rad, 0.1);
  EXPECT_EQ(trouble.reason, "wished landing is not a number: left out");
}

}  // namespace

}  // namespace mimesis::walker
