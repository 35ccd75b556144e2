#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nodes/crowd/run/watch.h"

namespace mimesis::crowd {
namespace {

constexpr double kOmega = 5.0;

Observed agent(double heading_rad, double avoid_rad_s) {
  Observed a{.id = 1};
  a.heading_rad = heading_rad;
  a.goal_W_m = {10.0, 0.0};
  a.avoid_rad_s = avoid_rad_s;
  return a;
}

TEST(Turning, ToAGoalIsTheTangentOfHalfTheAngle) {
  const HeadingRule rule{.kind = HeadingKind::goal, .gain = 1.5, .avoid = true};
  const RuleCertificate c{.beyond_m = 6.0};
  const auto error = [&](double heading, double avoid) {
    return turn_error({}, rule, c, kOmega, agent(heading, avoid));
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
  EXPECT_TRUE(std::isfinite(turn_error({}, rule, {.beyond_m = 9.9}, kOmega, agent(0.3, 0.0))));
  EXPECT_TRUE(std::isnan(turn_error({}, rule, {.beyond_m = 10.1}, kOmega, agent(0.3, 0.0))));
}

TEST(Turning, ToALaneIsTheAngleToItsDirection) {
  const HeadingRule rule{.kind = HeadingKind::lane, .gain = 0.6, .avoid = true};
  Group group;
  group.heading_rad = 3.0;
  const auto error = [&](double heading, double avoid) {
    return turn_error(group, rule, {}, kOmega, agent(heading, avoid));
  };
  EXPECT_NEAR(error(3.0 + 0.08 - 2.0 * M_PI, 0.0), 0.08, 1e-12);
  EXPECT_TRUE(std::isnan(error(3.12, 0.0)));
  EXPECT_TRUE(std::isfinite(error(3.08, 0.09 * 0.6 * kOmega * 0.08)));  // a tenth of omega m sin e
  EXPECT_TRUE(std::isnan(error(3.08, 0.11 * 0.6 * kOmega * 0.08)));
}

TEST(Turning, OtherRulesHaveNone) {
  for (const HeadingKind kind : {HeadingKind::keep, HeadingKind::consensus, HeadingKind::coupled}) {
    EXPECT_TRUE(std::isnan(turn_error({}, {.kind = kind}, {}, kOmega, agent(0.1, 0.0))));
  }
}

}  // namespace
}  // namespace mimesis::crowd
