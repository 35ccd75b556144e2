// Guarantees for headings: lanes, each other, goals.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <complex>

#include "nodes/crowd/certificate/swaying_way.h"
#include "nodes/crowd/certificate/test/line.h"

namespace mimesis::crowd {
namespace {

/// Rate at which a walker comes to its lane, of the largest |ψ, ξ/Δz| in turns of the gait.
double lane_rate(const GaitRange& gait, double m, double ahead_m) {
  double psi = 1e-4, y = 1e-4, log_size = 0.0;
  constexpr double kStep = 1e-3;
  constexpr int kCycles = 200;
  for (double phi = 0.0; phi < kCycles * 2.0 * M_PI; phi += kStep) {
    y += kStep * gait.gait(phi) / ahead_m * std::sin(psi);
    psi += kStep * m * std::sin(-std::atan(y) - psi);
    const double size = std::hypot(psi, y);
    if (size > 1e-5 && size < 1e-3) continue;
    log_size += std::log(size / 1e-4);
    psi *= 1e-4 / size;
    y *= 1e-4 / size;
  }
  log_size += std::log(std::hypot(psi, y) / 1e-4);
  return -log_size / (kCycles * 2.0 * M_PI) * gait.eigenfrequency_rad_s;
}

TEST(Certificate, LaneRateIsThatOfTheWholeCycle) {
  for (const double amplitude : {0.0, 0.06}) {
    const double swings[] = {0.0, amplitude};
    const GaitRange g{SpeedFunction(0.2, {}, swings), 5.76};
    for (const auto& [m, ahead] : {std::pair(0.5, 0.1), {0.2, 2.0}, {1.5, 2.0}, {0.5, 0.8}}) {
      Rules rules;
      rules.heading = {.kind = HeadingKind::lane, .gain = m, .ahead_m = ahead};
      const RuleCertificate c = certify(rules, 3, g).heading;
      const double rate = lane_rate(g, m, ahead);
      EXPECT_NEAR(c.guaranteed_1_s, rate, 0.01 * rate + 2e-3) << m << ' ' << ahead;
      EXPECT_TRUE(c.in_the_end);
      EXPECT_EQ(c.change.empty(), m >= 4.0 * 0.2 / ahead);  // else lanes overshoot
      if (amplitude == 0.0) {
        const double root = std::max(0.0, 1.0 - 4.0 * 0.2 / (ahead * m));
        EXPECT_NEAR(c.guaranteed_1_s, 0.5 * 5.76 * m * (1.0 - std::sqrt(root)), 1e-3);
      }
    }
  }
}

TEST(Certificate, LanesThatStepsDriveAreNotCertified) {
  const double swings[] = {0.0, 0.06};
  const GaitRange g{SpeedFunction(0.2, {}, swings), 5.76};
  const auto lane = [&](double m, double ahead) {  // m g/Δz = 1: half of the frequency of g
    Rules rules;
    rules.heading = {.kind = HeadingKind::lane, .gain = m, .ahead_m = ahead};
    return certify(rules, 3, g).heading;
  };
  EXPECT_NEAR(lane(0.5, 0.1).guaranteed_1_s, 1.04, 0.03);  // roots of one g: m ω/2 = 1.44
  EXPECT_NEAR(lane_rate(g, 0.1, 0.02), -0.14, 0.02);
  EXPECT_EQ(lane(0.1, 0.02).guarantee, Guarantee::none);
}

TEST(Certificate, ConsensusIsOfAnArc) {  // all in D < π: tan(D/2) decays at m ω
  Rules rules;
  rules.heading = {.kind = HeadingKind::consensus, .gain = 0.4};
  const RuleCertificate c = certify(rules, 3, gait()).heading;
  EXPECT_NEAR(c.within, M_PI, 1e-12);
  EXPECT_NEAR(c.guaranteed_1_s, 0.4 * kOmega, 1e-12);
  EXPECT_FALSE(c.in_the_end);
  rules.heading.low_pass_s = 1.0;
  EXPECT_TRUE(certify(rules, 3, gait()).heading.in_the_end);
}

TEST(Certificate, CoupledHeadingsHaveARegion) {
  Rules rules;
  rules.heading = {.kind = HeadingKind::coupled, .graph = {Topology::ring}, .gain = 0.8};
  const RuleCertificate wide = certify(rules, 6, gait()).heading;
  EXPECT_NEAR(wide.expected_1_s, 0.8, 1e-12);
  EXPECT_NEAR(wide.guaranteed_1_s, 0.8 * std::cos(wide.within), 1e-12);
  EXPECT_NEAR(wide.within, M_PI / 6, 1e-3);
  rules.heading.spread_rad = 0.5;  // slope of sin x exp(−x²/2σ²) is zero where x tan x = σ²
  const RuleCertificate narrow = certify(rules, 6, gait()).heading;
  const double zero = 3.0 * narrow.within;
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

/// Where the lane is far ahead, ψ' = −m ψ + g^ψ: a harmonic a e^{ikφ} of the sway is a/(m + ik) of
/// the heading; nearer, walkers end on the way that was found.
TEST(Certificate, SwayKeepsWalkersOnOneWay) {
  const std::vector<double> cosine{0.012, -0.004, 0.0, 0.002}, sine{-0.006, 0.003, 0.005, 0.0};
  const std::vector<double> steps{0.0, 0.03};
  const HeadingSway sway = HeadingSway::make(cosine, sine);
  const SpeedFunction g(0.2, {}, steps);
  const double m = 0.8;
  const auto far = swaying_way(g, sway, m, 1e9);
  ASSERT_TRUE(far);
  for (const double phi : {0.1, 1.3, 2.9, 5.5}) {
    double wanted = 0.0;
    for (int k = 1; k <= 4; ++k) {
      const auto h = static_cast<std::size_t>(k - 1);
      const std::complex<double> a(cosine[h], -sine[h]);
      wanted += (a * std::polar(1.0, k * phi) / std::complex<double>(m, k)).real();
    }
    EXPECT_NEAR(far->at(phi).first, wanted, 1e-5);
    EXPECT_NEAR(far->at(phi).second, 0.0, 1e-6);
  }
  const double ahead = 1.5;
  const auto near = swaying_way(g, sway, m, ahead);
  ASSERT_TRUE(near);
  double psi = 0.2, y = -0.1, phi = 0.0;
  const double h = 1e-3;
  for (; phi < 60.0 * M_PI; phi += h) {
    psi += h * (-m * std::sin(psi + std::atan(y)) + sway(phi));
    y += h * g(phi) * std::sin(psi) / ahead;
  }
  EXPECT_NEAR(near->at(phi).first, psi, 1e-4);
  EXPECT_NEAR(near->at(phi).second, y, 1e-4);
  EXPECT_NEAR(near->most, 0.02, 0.02);
}

}  // namespace
}  // namespace mimesis::crowd
