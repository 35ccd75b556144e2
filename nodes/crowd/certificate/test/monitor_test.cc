#include "nodes/crowd/certificate/monitor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/testing/no_malloc.h"

namespace mimesis::crowd {
namespace {

GaitRange gait() { return {SpeedFunction(0.2, {}, {}), 5.0, 0.0}; }

Rules phase_rules() {
  Rules rules;
  rules.phase = {.graph = {Topology::ring}, .gain_1_s = 1.5};
  return rules;
}

TEST(RateFit, FindsTheRateOfADecayInItsBand) {
  RateFit fit(1e-6, 3e-2);
  for (int i = 0; i < 4000; ++i) {
    const double t = 100.0 + 0.01 * i;
    const double plateau = 0.7, decay = 2.0 * std::exp(-1.3 * (t - 100.0));
    fit.add(t, std::min(plateau, decay) + 1e-9 * std::sin(t));
  }
  ASSERT_TRUE(fit.rate_1_s());
  EXPECT_NEAR(*fit.rate_1_s(), 1.3, 1e-3);
}

TEST(RateFit, SaysNothingBeforeItCan) {
  RateFit fit(1e-6, 3e-2);
  EXPECT_FALSE(fit.rate_1_s());
  for (int i = 0; i < 100; ++i) fit.add(0.01 * i, 2e-2 * std::exp(-0.01 * i));  // fell by e
  EXPECT_FALSE(fit.rate_1_s());
  for (int i = 100; i < 250; ++i) fit.add(0.01 * i, 2e-2 * std::exp(-0.01 * i));
  ASSERT_TRUE(fit.rate_1_s());
  EXPECT_NEAR(*fit.rate_1_s(), 1.0, 1e-9);
}

TEST(RateFit, BeginsAnewAfterADisturbance) {
  RateFit fit(1e-6, 3e-2);
  for (int i = 0; i < 500; ++i) fit.add(0.01 * i, 2e-2 * std::exp(-0.02 * i));
  fit.add(5.0, 0.5);
  EXPECT_FALSE(fit.rate_1_s());
  for (int i = 0; i < 500; ++i) fit.add(5.0 + 0.01 * i, 2e-2 * std::exp(-0.01 * i));
  EXPECT_NEAR(fit.rate_1_s().value(), 1.0, 1e-9);
}

TEST(RateFit, ItsLineReachesValuesInsideAndOutsideOfTheBand) {
  RateFit fit(1e-6, 3e-2);
  EXPECT_FALSE(fit.reaches_s(1.0));
  // R = 1 at t = 22, the offset of a decay that began at 20
  for (int i = 0; i < 4000; ++i) fit.add(20.0 + 0.01 * i, std::exp(-0.8 * (0.01 * i - 2.0)));
  EXPECT_NEAR(fit.reaches_s(1.0).value(), 22.0, 1e-6);
  EXPECT_NEAR(fit.reaches_s(std::exp(-4.0)).value(), 27.0, 1e-6);
}

TEST(RateFit, SeesGrowthAndLeavesOutNan) {
  RateFit fit(1e-6, 3e-2);
  for (int i = 0; i < 500; ++i) {
    fit.add(0.01 * i, 1e-5 * std::exp(0.012 * i));
    fit.add(0.01 * i, std::numeric_limits<double>::quiet_NaN());
  }
  EXPECT_NEAR(fit.rate_1_s().value(), -1.2, 1e-9);
}

TEST(Monitor, PutsMeasuredBesideGuaranteed) {
  Monitor monitor;
  EXPECT_FALSE(monitor.report().valid);
  const Certificate certificate = certify(phase_rules(), 6, gait());
  const double rate = certificate.phase.guaranteed_1_s;
  EXPECT_NEAR(rate, 1.5, 1e-12);  // ring of six: lambda+ = 1
  monitor.certify(certificate);
  GroupErrors errors;
  {
    const testing::NoMalloc guard;
    for (int i = 0; i < 400; ++i) {
      errors.dispersion = 2e-2 * std::exp(-rate * 0.01 * i);
      errors.heading_rad = errors.tracking_rad = errors.spacing_m =
          std::numeric_limits<double>::quiet_NaN();
      monitor.step(0.01 * i, errors);
    }
  }
  const MonitorReport report = monitor.report();
  EXPECT_TRUE(report.valid);
  EXPECT_EQ(report.agents, 6);
  EXPECT_NEAR(report.phase.measured_1_s.value(), rate, 1e-9);
  EXPECT_FALSE(report.phase.broken());
  EXPECT_FALSE(report.spacing.measured_1_s);
  EXPECT_EQ(report.spacing.guarantee, Guarantee::off);
}

TEST(Monitor, SaysWhenARateIsBelowItsGuarantee) {
  Monitor monitor;
  monitor.certify(certify(phase_rules(), 6, gait()));
  for (int i = 0; i < 400; ++i) {
    monitor.step(0.01 * i, {.dispersion = 2e-2 * std::exp(-1.4 * 0.01 * i)});
  }
  EXPECT_TRUE(monitor.report().phase.broken());
}

TEST(Monitor, MeasuresAnewWhenCertifiedAnew) {
  Monitor monitor;
  monitor.certify(certify(phase_rules(), 6, gait()));
  for (int i = 0; i < 400; ++i) monitor.step(0.01 * i, {.dispersion = 2e-2 * std::exp(-0.02 * i)});
  monitor.certify(certify(phase_rules(), 5, gait()));
  const MonitorReport report = monitor.report();
  EXPECT_TRUE(report.valid);
  EXPECT_FALSE(report.phase.measured_1_s);  // no rate yet for the group as it is
  EXPECT_GT(report.phase.guaranteed_1_s, 1.5);
}

TEST(Monitor, SpacingThatWaitsForPhasesIsMeasuredOnceTheyAgree) {
  Rules rules = phase_rules();
  rules.length = {.graph = {Topology::all_to_all}, .gain_1_m = 0.05};
  Monitor monitor;
  monitor.certify(certify(rules, 6, gait()));
  const double rate = monitor.report().spacing.guaranteed_1_s;
  EXPECT_NEAR(rate, 0.05 * 5.0 * 0.2 * 6, 1e-12);
  for (int i = 0; i < 3000; ++i) {
    const double t = 0.01 * i;
    monitor.step(t, {.dispersion = i < 600 ? 0.1 : 1e-3,
                     .spacing_m = i < 600 ? 1.0 : std::exp(-rate * (t - 6.0))});
  }
  EXPECT_NEAR(monitor.report().spacing.measured_1_s.value(), rate, 1e-3 * rate);
}

TEST(Monitor, SpacingIsMeasuredWherePhasesAddNoMoreThanAHundredth) {
  Rules rules;
  rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 0.15};  // 0.9 1/s
  rules.length = {.graph = {Topology::all_to_all}, .gain_1_m = 0.05};
  Monitor monitor;
  monitor.certify(certify(rules, 6, gait()));
  const RuleCertificate& c = monitor.certificate().length;
  const double rate = c.guaranteed_1_s;
  EXPECT_NEAR(c.per_phase_m_rad, 0.2 * 0.9 / (0.9 - rate), 1e-12);
  // ẋ = −r x + r g δ, δ = exp(−0.9 t) of phases, with x(0) against it: the error grows first
  const double a = 0.2 * rate / (0.9 - rate);
  for (int i = 0; i < 4000; ++i) {
    const double t = 0.01 * i, phases = std::exp(-0.9 * t);
    monitor.step(t, {.dispersion = 0.01 * phases,
                     .spacing_m = 0.3 * std::exp(-rate * t) - a * phases,
                     .phases_rad = phases});
  }
  EXPECT_NEAR(monitor.report().spacing.measured_1_s.value(), rate, 2e-3 * rate);
}

}  // namespace
}  // namespace mimesis::crowd
