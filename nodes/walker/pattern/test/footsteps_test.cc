#include "nodes/walker/pattern/footsteps.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace mimesis::walker {
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
    double beyond = -1.0;  // of the worse foot
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
