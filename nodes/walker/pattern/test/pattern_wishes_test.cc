// What patterns make of wishes: landings, changes at any time, too much, no numbers.
#include <gtest/gtest.h>

#include <random>

#include "nodes/walker/pattern/test/patterns.h"

namespace mimesis::walker {
namespace {

using namespace testing;

TEST_P(Patterns, MeetWishedLandings) {
  for (const double length : {0.15, 0.22, 0.2805}) {
    auto pattern = make();
    run(*pattern, forward(0.25), 160 * 5);
    // the foot after the next one: every generator can still place it
    const Footprint next = pattern->now().landing;
    Footprint wished{robot::other(next.side), next.p_W_m, next.yaw_rad + 0.02};
    wished.p_W_m += Eigen::Vector2d(length, robot::sign(wished.side) * 0.19);
    Wish wish = forward(length / 0.8);
    wish.velocity_m_s.x() = std::min(0.35, wish.velocity_m_s.x());
    wish.landing[0] = next;
    wish.landing[1] = wished;
    run(*pattern, wish, 160);
    wish.landing = {wished, std::nullopt};
    run(*pattern, wish, 159);
    EXPECT_FALSE(pattern->trouble().clipped);
    run(*pattern, wish, 1);
    const Footprint landed = ground_pose(pattern->now().foot[wished.side], wished.side);
    EXPECT_LT((landed.p_W_m - wished.p_W_m).norm(), 1e-3) << length;
    EXPECT_NEAR(landed.yaw_rad, wished.yaw_rad, 1e-3);
  }
}

TEST_P(Patterns, ChangeALandingInTheMiddleOfTheSwing) {
  if (!GetParam().places_feet_in_time) GTEST_SKIP() << "decides before the swing";
  auto pattern = make();
  run(*pattern, forward(0.2), 160 * 5 + 60);
  Wish wish = forward(0.2);
  wish.landing[0] = pattern->now().landing;
  wish.landing[0]->p_W_m += Eigen::Vector2d(0.03, 0.02 * robot::sign(wish.landing[0]->side));
  run(*pattern, wish, 100);
  const Footprint landed =
      ground_pose(pattern->now().foot[wish.landing[0]->side], wish.landing[0]->side);
  EXPECT_LT((landed.p_W_m - wish.landing[0]->p_W_m).norm(), 1e-3);
}

TEST_P(Patterns, SayThatALandingIsOutOfReach) {
  auto pattern = make();
  run(*pattern, forward(0.2), 160 * 5 + 10);
  Wish wish = forward(0.2);
  wish.landing[0] = pattern->now().landing;
  wish.landing[0]->p_W_m.x() += 1.0;
  run(*pattern, wish, 149);
  EXPECT_TRUE(pattern->trouble().clipped);
  EXPECT_EQ(pattern->trouble().failed_solves, 0);
}

TEST_P(Patterns, KeepUprightForMinutesOfRandomWishes) {
  for (const unsigned seed : {1u, 2u}) {
    const GaitSettings gait;
    auto pattern = make(gait);
    Watch watch(gait);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-1.0, 1.0);
    Wish wish;
    int until = 0;
    for (int i = 0; i < 200 * 60; ++i) {
      if (i == until) {  // anything, at any time, from one tick to 4 s
        until = i + 1 + static_cast<int>(std::pow(std::abs(uniform(random)), 2.0) * 800.0);
        wish.velocity_m_s = {0.5 * uniform(random), 0.2 * uniform(random)};
        wish.yaw_rate_rad_s = 0.3 * uniform(random);
        wish.walk = uniform(random) > -0.6;
        wish.landing = {};
        for (std::size_t k = 0; k < 2; ++k)
          if (uniform(random) > 0.5) {
            const PatternSample& s = pattern->now();
            const Side side = uniform(random) > 0.0 ? kLeft : kRight;
            wish.landing[k] = Footprint{
                side,
                s.com.p_W_m + Eigen::Vector2d(0.4 * uniform(random),
                                              robot::sign(side) * 0.1 + 0.3 * uniform(random)),
                s.yaw_rad + 0.3 * uniform(random)};
          }
      }
      pattern->step(wish);
      watch.look(pattern->now());
      ASSERT_EQ(pattern->trouble().failed_solves, 0) << i << pattern->trouble().reason;
    }
    SCOPED_TRACE(seed);
    expect_all_right(watch, GetParam(), gait);
  }
}

TEST_P(Patterns, StopAndStartAgainAtEveryInstant) {
  const GaitSettings gait;
  for (int at = 0; at < 800; at += 41) {
    auto pattern = make(gait);
    Watch watch(gait);
    const auto go = [&](const Wish& wish, int ticks) {
      for (int i = 0; i < ticks; ++i) {
        pattern->step(wish);
        watch.look(pattern->now());
        ASSERT_EQ(pattern->trouble().failed_solves, 0) << at;
      }
    };
    go(forward(0.35), 160 + at);
    go(stop(), at);
    go(forward(-0.2), 400);
    go(stop(), 900);
    EXPECT_EQ(pattern->now().gait, Gait::kStanding);
    SCOPED_TRACE(at);
    expect_all_right(watch, GetParam(), gait);
  }
}

TEST_P(Patterns, StopForAWishThatIsNoNumber) {
  auto pattern = make();
  run(*pattern, forward(0.3), 1000);
  Wish wish = forward(kNan);
  run(*pattern, wish, 1);
  EXPECT_NE(pattern->trouble().reason.find("not a number"), std::string::npos);
  run(*pattern, wish, 1200);
  EXPECT_EQ(pattern->now().gait, Gait::kStanding);
  wish = forward(0.2);
  wish.landing[0] = Footprint{kLeft, {kNan, 0.0}, 0.0};
  run(*pattern, wish, 500);
  EXPECT_EQ(pattern->now().gait, Gait::kWalking);
  EXPECT_TRUE(pattern->now().com.p_W_m.allFinite());
  EXPECT_FALSE(pattern->trouble().reason.empty());
}

TEST_P(Patterns, CutWhatIsTooFast) {
  auto pattern = make();
  run(*pattern, forward(5.0), 160 * 8);
  EXPECT_TRUE(pattern->trouble().clipped);
  const double x = pattern->now().com.p_W_m.x();
  run(*pattern, forward(5.0), 320);
  EXPECT_NEAR((pattern->now().com.p_W_m.x() - x) / 1.6, 0.35, 0.02 * 0.35);
  pattern->step(forward(0.2));
  EXPECT_FALSE(pattern->trouble().clipped);
}

TEST_P(Patterns, WalkWithOtherSettings) {
  GaitSettings gait;
  gait.com_height_m = 1.0;
  gait.step_s = 0.7;
  gait.double_support_s = 0.2;
  gait.feet_distance_m = 0.22;
  auto pattern = make(gait);
  Watch watch(gait);
  for (int i = 0; i < 4000; ++i) {
    pattern->step(i < 3000 ? forward(0.25) : stop());
    watch.look(pattern->now());
  }
  expect_all_right(watch, GetParam(), gait);
  EXPECT_EQ(pattern->now().gait, Gait::kStanding);
}

}  // namespace
}  // namespace mimesis::walker
