#include <gtest/gtest.h>

#include <cmath>

#include "nodes/crowd/run/watch.h"

namespace mimesis::crowd {
namespace {

Observed agent(double heading_rad, double avoid_rad_s) {
  Observed a{.id = 1};
  a.heading_rad = heading_rad;
  a.goal_W_m = a.next_W_m = {10.0, 0.0};
  a.avoid_rad_s = avoid_rad_s;
  return a;
}

TEST(Turning, ToAGoalIsTheTangentOfHalfTheAngle) {
  const HeadingRule rule{.kind = HeadingKind::goal, .gain = 1.5, .avoid = true};
  const RuleCertificate c{.beyond_m = 6.0};
  const auto error = [&](double heading, double avoid) {
    return turn_error({}, rule, c, agent(heading, avoid));
  };
  EXPECT_NEAR(error(0.8, 0.0), 2.0 * std::tan(0.4), 1e-12);
  EXPECT_NEAR(error(-0.8, 0.0), 2.0 * std::tan(0.4), 1e-12);
  // a twentieth of k sin e
  const double free = 0.05 * 1.5 * std::sin(0.8);
  EXPECT_TRUE(std::isfinite(error(0.8, 0.99 * free)));
  EXPECT_TRUE(std::isfinite(error(0.8, -0.99 * free)));
  EXPECT_TRUE(std::isnan(error(0.8, 1.01 * free)));
  EXPECT_TRUE(std::isnan(error(0.8, -1.01 * free)));
  EXPECT_TRUE(std::isnan(error(0.8, std::nan(""))));
}

TEST(Turning, NotNearerToTheGoalThanTheCertificateHolds) {
  const HeadingRule rule{.kind = HeadingKind::goal, .gain = 1.5};
  EXPECT_TRUE(std::isfinite(turn_error({}, rule, {.beyond_m = 9.9}, agent(0.3, 0.0))));
  EXPECT_TRUE(std::isnan(turn_error({}, rule, {.beyond_m = 10.1}, agent(0.3, 0.0))));
}

TEST(Turning, ToALaneIsTheAngleToItsDirectionAndTheWayToIt) {
  const HeadingRule rule{.kind = HeadingKind::lane, .gain = 0.6, .ahead_m = 2.0, .avoid = true};
  Group group;
  group.heading_rad = 3.0;
  group.origin_x_m = 1.0;
  const RuleCertificate c{.guaranteed_1_s = 0.8};
  const auto error = [&](double heading, double to_lane_m, double avoid) {
    Observed a = agent(heading, avoid);
    a.lane_m = 0.5 + to_lane_m;
    a.p_W_m = Eigen::Vector2d(1.0, 0.0) + 0.5 * Eigen::Vector2d(-std::sin(3.0), std::cos(3.0));
    return turn_error(group, rule, c, a);
  };
  EXPECT_NEAR(error(3.0 + 0.08 - 2.0 * M_PI, 0.0, 0.0), 0.08, 1e-12);
  EXPECT_NEAR(error(3.03, -0.08, 0.0), 0.05, 1e-12);
  EXPECT_TRUE(std::isnan(error(3.12, 0.0, 0.0)));
  EXPECT_TRUE(std::isnan(error(3.0, 0.25, 0.0)));
  EXPECT_TRUE(std::isfinite(error(3.08, 0.0, 0.049 * 0.8 * 0.08)));  // a twentieth of the rate
  EXPECT_TRUE(std::isnan(error(3.08, 0.0, 0.051 * 0.8 * 0.08)));
}

TEST(Turning, OtherRulesHaveNone) {
  for (const HeadingKind kind : {HeadingKind::keep, HeadingKind::consensus, HeadingKind::coupled}) {
    EXPECT_TRUE(std::isnan(turn_error({}, {.kind = kind}, {}, agent(0.1, 0.0))));
  }
}

}  // namespace
}  // namespace mimesis::crowd
