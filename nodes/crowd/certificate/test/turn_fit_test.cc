#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/testing/no_malloc.h"
#include "nodes/crowd/certificate/monitor.h"
#include "nodes/crowd/certificate/rate_fit.h"

namespace mimesis::crowd {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// A turn from `begin` at a rate, for some seconds from t on.
void turn(TurnFit& fit, std::uint64_t agent, double t_s, double begin, double rate, double for_s) {
  for (double t = 0.0; t < for_s; t += 0.02) {
    fit.add(agent, t_s + t, begin * std::exp(-rate * t));
  }
}

TEST(TurnFit, PoolsTheTurnsOfAll) {
  TurnFit fit(1e-3, 1.5);
  EXPECT_FALSE(fit.rate_1_s());
  turn(fit, 1, 0.0, 0.8, 1.4, 2.0);
  turn(fit, 2, 0.3, 0.2, 1.4, 1.5);
  turn(fit, 1, 9.0, 0.5, 1.4, 2.0);  // after a pause: a line of its own
  ASSERT_TRUE(fit.rate_1_s());
  EXPECT_NEAR(*fit.rate_1_s(), 1.4, 1e-9);
  // Two slopes of equal lengths: their mean.
  TurnFit both(1e-3, 1.5);
  turn(both, 1, 0.0, 1.0, 1.0, 2.0);
  turn(both, 2, 0.0, 1.0, 2.0, 2.0);
  EXPECT_NEAR(both.rate_1_s().value(), 1.5, 1e-9);
  both.restart();
  EXPECT_FALSE(both.rate_1_s());
}

TEST(TurnFit, CountsTurnsThatStallAndGrow) {
  TurnFit fit(1e-3, 1.5);
  turn(fit, 3, 0.0, 0.8, 10.0, 0.12);  // seven samples
  turn(fit, 1, 0.0, 0.8, 1.0, 0.9);
  EXPECT_FALSE(fit.rate_1_s()) << "too early";
  turn(fit, 4, 0.0, 0.8, 1.0, 2.0);
  EXPECT_NEAR(fit.rate_1_s().value(), 1.0, 1e-9);
  turn(fit, 5, 0.0, 0.3, 0.0, 2.0);  // half of the headings stall: half of the rate
  EXPECT_NEAR(fit.rate_1_s().value(), 0.52, 0.02);
  TurnFit grows(1e-3, 1.5);
  turn(grows, 2, 0.0, 0.1, -1.0, 2.0);
  EXPECT_NEAR(grows.rate_1_s().value(), -1.0, 1e-9);
  TurnFit stalls(1e-3, 1.5);
  turn(stalls, 2, 0.0, 0.1, 0.0, 4.9);
  EXPECT_FALSE(stalls.rate_1_s());
  turn(stalls, 2, 4.9, 0.1, 0.0, 0.5);
  EXPECT_NEAR(stalls.rate_1_s().value(), 0.0, 1e-9);
}

TEST(TurnFit, EndsATurnWhereItIsDisturbedOrOutOfTheBand) {
  for (const double disturbed : {kNone, 2.0, 1e-4}) {
    TurnFit fit(1e-3, 1.5);
    turn(fit, 1, 0.0, 0.8, 1.0, 0.6);
    fit.add(1, 0.6, disturbed);
    turn(fit, 1, 0.62, 0.8, 1.0, 0.6);
    EXPECT_NEAR(fit.rate_1_s().value(), 1.0, 1e-9) << disturbed;
  }
}

TEST(TurnFit, DoesNotAllocateForWhoIsKnown) {
  TurnFit fit(1e-3, 1.5);
  fit.add(7, 0.0, 0.5);
  const testing::NoMalloc guard;
  for (int i = 1; i < 100; ++i) fit.add(7, 0.02 * i, 0.5 * std::exp(-0.04 * i));
  EXPECT_TRUE(fit.rate_1_s());
}

TEST(Monitor, KeepsTurnsWhileOthersComeAndGo) {
  Rules rules;
  rules.heading = {.kind = HeadingKind::goal, .gain = 1.5, .avoid = true};
  const GaitRange gait{SpeedFunction(0.2, {}, {}), 5.0, 0.0};
  Monitor monitor;
  monitor.certify(certify(rules, 4, gait));
  for (int i = 0; i < 100; ++i) monitor.turn(3, 0.02 * i, std::exp(-1.4 * 0.02 * i));
  EXPECT_NEAR(monitor.report().heading.measured_1_s.value(), 1.4, 1e-9);
  monitor.certify(certify(rules, 3, gait));
  EXPECT_NEAR(monitor.report().heading.measured_1_s.value(), 1.4, 1e-9);
  rules.heading.gain = 1.2;
  monitor.certify(certify(rules, 3, gait));
  EXPECT_FALSE(monitor.report().heading.measured_1_s);
}

TEST(Monitor, TracksABeatByAgent) {
  Rules rules;
  const GaitRange gait{SpeedFunction(0.2, {}, {}), 5.0, 0.0, 2.5, 5.0};
  Monitor monitor;
  monitor.certify(certify(rules, 4, gait));
  for (int i = 0; i < 100; ++i) {
    monitor.track(3, 0.02 * i, std::exp(-2.4 * 0.02 * i));
    monitor.step(0.02 * i, {.tracking_rad = 0.09 * std::exp(-9.0 * 0.02 * i)});
  }
  const RuleReport tracking = monitor.report().tracking;
  EXPECT_NEAR(tracking.measured_1_s.value(), 2.4, 1e-9);
  EXPECT_EQ(tracking.guaranteed_1_s, 2.5);
}

}  // namespace
}  // namespace mimesis::crowd
