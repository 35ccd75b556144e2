// Guarantees for headings: lanes, each other, goals.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>

#include "nodes/crowd/certificate/rate_fit.h"
#include "nodes/crowd/certificate/test/line.h"

namespace mimesis::crowd {
namespace {

TEST(Certificate, LaneRateIsThatOfTheLinearLoop) {
  Rules rules;
  for (const double m : {0.2, 1.5}) {
    rules.heading = {.kind = HeadingKind::lane, .gain = m, .ahead_m = 2.0};
    const RuleCertificate c = certify(rules, 3, gait()).heading;
    EXPECT_LE(c.guaranteed_1_s, c.expected_1_s);
    const double least_g = 0.12, root = std::max(0.0, 1.0 - 4.0 * least_g / (2.0 * m));
    EXPECT_NEAR(c.guaranteed_1_s, 0.5 * kOmega * m * (1.0 - std::sqrt(root)), 1e-12);
    double psi = 0.0, xi = 0.01, t = 0.0;
    RateFit fit(1e-9, 5e-3);
    double peak = 0.0, last = 0.0;
    while (t < 60.0) {  // ψ̇ = ω m sin(ψ_goal − ψ), ξ̇ = ω⟨g⟩ sin ψ
      psi += kDt * kOmega * m * std::sin(-std::atan2(xi, 2.0) - psi);
      xi += kDt * kOmega * 0.2 * std::sin(psi);
      t += kDt;
      if (m > 0.4) {
        fit.add(t, std::abs(xi));
        continue;
      }
      if (last < 0.0 && xi >= 0.0) {  // it oscillates: peaks of |xi|
        if (peak > 0.0) fit.add(t, peak);
        peak = 0.0;
      }
      peak = std::max(peak, xi);
      last = xi;
    }
    if (m > 0.4) {
      EXPECT_NEAR(fit.rate_1_s().value(), c.expected_1_s, 0.01 * c.expected_1_s);
      EXPECT_TRUE(c.change.empty());
    } else {
      EXPECT_NEAR(c.expected_1_s, 0.5 * kOmega * m, 1e-12);
      EXPECT_FALSE(c.change.empty());  // lanes overshoot below 4 g/ahead = .4
    }
  }
}

TEST(Certificate, CoupledHeadingsHaveARegion) {
  Rules rules;
  rules.heading = {.kind = HeadingKind::coupled, .graph = {Topology::ring}, .gain = 0.8};
  const RuleCertificate wide = certify(rules, 6, gait()).heading;
  EXPECT_NEAR(wide.expected_1_s, 0.8, 1e-12);
  EXPECT_NEAR(wide.guaranteed_1_s, 0.8 * std::cos(wide.within), 1e-12);
  EXPECT_NEAR(wide.within, M_PI / 3, 1e-3);
  rules.heading.spread_rad = 0.5;  // slope of sin x exp(−x²/2σ²) is zero where x tan x = σ²
  const RuleCertificate narrow = certify(rules, 6, gait()).heading;
  const double zero = 1.5 * narrow.within;
  EXPECT_NEAR(zero * std::tan(zero), 0.25, 5e-3);
}

TEST(Certificate, HeadingsComeToTheirGoalsAsFastAsGuaranteedWhileThoseAreFar) {
  Rules rules;
  rules.heading = {.kind = HeadingKind::goal, .gain = 1.5};
  const RuleCertificate c = certify(rules, 1, gait()).heading;
  const double fastest = kOmega * 0.28;
  EXPECT_DOUBLE_EQ(c.expected_1_s, 1.5);
  EXPECT_NEAR(c.guaranteed_1_s, 1.5 - fastest / c.beyond_m, 1e-12);
  // An agent goes straight to its goal, off by e, at the largest speed: tan(e/2) never decays
  // slower.
  Eigen::Vector2d p(0.0, 0.0);
  const Eigen::Vector2d goal(c.beyond_m + 4.0, 0.0);
  double psi = 1.0, before = 1.0;
  constexpr double kStep = 1e-4;
  bool far = true, tight = false;
  for (double t = 0.0; far; t += kStep) {
    const Eigen::Vector2d way = goal - p;
    far = way.norm() > c.beyond_m;
    const double e = psi - std::atan2(way.y(), way.x());
    const double tangent = std::tan(0.5 * e);
    if (t > 0.0) {
      const double rate = -std::log(tangent / before) / kStep;
      EXPECT_NEAR(rate, 1.5 - fastest / way.norm(), 1e-3) << t;
      EXPECT_GT(rate, c.guaranteed_1_s - 1e-3) << t;
      tight = tight || rate < c.guaranteed_1_s + 0.02;
    }
    before = tangent;
    psi -= kStep * 1.5 * std::sin(e);
    p += kStep * fastest * Eigen::Vector2d(std::cos(psi), std::sin(psi));
  }
  EXPECT_TRUE(tight);
  rules.length = {.graph = {Topology::ring}, .gain_1_m = 0.1, .limit = 0.4};  // longer steps
  EXPECT_NEAR(certify(rules, 5, gait()).heading.beyond_m, 1.4 * c.beyond_m, 1e-12);
}

}  // namespace
}  // namespace mimesis::crowd
