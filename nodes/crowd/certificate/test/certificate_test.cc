#include "nodes/crowd/certificate/certificate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

#include "common/math/circle.h"
#include "nodes/crowd/certificate/contraction.h"
#include "nodes/crowd/certificate/rate_fit.h"
#include "nodes/crowd/rules/phase.h"
#include "nodes/crowd/rules/spacing.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {
namespace {

constexpr double kOmega = 5.0, kDt = 2e-3;
constexpr double kSine[] = {0.0, 0.08};  // g = .2 + .08 sin 2φ, beta = .12/.28

GaitRange gait() { return {SpeedFunction(0.2, {}, kSine), kOmega, 0.0}; }

/// A crowd on a line, by Euler steps of the printed equations 4.28-4.31: nothing of the engine.
struct Line {
  Line(const Rules& r, int n, unsigned seed)
      : rules(r),
        frequency(coupling(r.frequency.graph, n)),
        length(coupling(r.length.graph, n)),
        phase(coupling(r.phase.graph, n)) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> uniform(-0.5, 0.5);
    for (int i = 0; i < n; ++i) {
      phi.push_back(spread_rad * uniform(random));
      z.push_back(spread_m * uniform(random));
    }
    d.assign(phi.size(), 0.0);
    error.assign(phi.size(), 0.0);
    filtered = rate = longer = error;
  }

  void step() {
    std::ranges::fill(rate, kOmega);
    std::ranges::fill(longer, 0.0);
    if (rules.frequency.gain_rad_m_s != 0.0) {
      spacing_errors(frequency, z, d, error);
      for (std::size_t i = 0; i < phi.size(); ++i) {
        const double alpha = rules.frequency.low_pass_rad_s;
        if (alpha > 0.0) filtered[i] += kDt * alpha * (error[i] - filtered[i]);
        rate[i] += frequency_change(rules.frequency, alpha > 0.0 ? filtered[i] : error[i]);
      }
    }
    if (rules.length.gain_1_m != 0.0) {
      spacing_errors(length, z, d, error);
      for (std::size_t i = 0; i < phi.size(); ++i) {
        longer[i] = step_length_change(rules.length, error[i]);
      }
    }
    if (rules.phase.gain_1_s != 0.0) {
      add_phase_coupling(phase, rules.phase.gain_1_s, phi, {}, rate);
    }
    for (std::size_t i = 0; i < phi.size(); ++i) {
      z[i] += (1.0 + longer[i]) * (g.integral(phi[i] + kDt * rate[i]) - g.integral(phi[i]));
      phi[i] += kDt * rate[i];
    }
    t += kDt;
  }

  double apart() const { return formation_error(z, d); }
  double phases_apart() const {
    const auto [least, most] = std::ranges::minmax(phi);
    return most - least;
  }

  Rules rules;
  CouplingGraph frequency, length, phase;
  double spread_rad = 1.0, spread_m = 0.6, t = 0.0;
  SpeedFunction g = gait().gait;
  std::vector<double> phi, z, d, error, filtered, rate, longer;
};

double measured(Line& line, double seconds, double (Line::*value)() const, double least,
                double most) {
  RateFit fit(least, most);
  while (line.t < seconds) {
    line.step();
    fit.add(line.t, (line.*value)());
  }
  return fit.rate_1_s().value_or(std::numeric_limits<double>::quiet_NaN());
}

TEST(Certificate, PhaseRateIsMeasuredOnEveryGraph) {
  for (const Topology topology :
       {Topology::chain, Topology::ring, Topology::star, Topology::all_to_all}) {
    Rules rules;
    rules.phase = {.graph = {topology}, .gain_1_s = 1.2};
    const Certificate c = certify(rules, 5, gait());
    Line line(rules, 5, 1);
    const double rate = measured(line, 40.0, &Line::phases_apart, 1e-6, 3e-2);
    EXPECT_NEAR(rate, c.phase.expected_1_s, 0.01 * rate) << to_string(topology);
    EXPECT_EQ(c.rate_1_s(), c.phase.guaranteed_1_s);
    EXPECT_TRUE(c.holds());
  }
}

TEST(Certificate, StepLengthConvergesAtTheAveragedRateAboveTheBound) {
  for (const Topology topology : {Topology::ring, Topology::all_to_all}) {
    Rules rules;
    rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 2.0};
    rules.length = {.graph = {topology}, .gain_1_m = 0.1};
    const Certificate c = certify(rules, 6, gait());
    Line line(rules, 6, 2);
    const double rate = measured(line, 120.0, &Line::apart, 1e-8, 1e-3);
    EXPECT_NEAR(rate, c.length.expected_1_s, 0.01 * rate) << to_string(topology);
    EXPECT_GT(rate, c.length.guaranteed_1_s);
    EXPECT_NEAR(c.length.guaranteed_1_s / c.length.expected_1_s, 0.12 / 0.2, 1e-12);
  }
}

TEST(Certificate, StepFrequencyConvergesAtTheAveragedRateAboveTheBound) {
  Rules rules;
  rules.frequency = {.graph = {Topology::all_to_all}, .gain_rad_m_s = 0.3};
  const Certificate c = certify(rules, 5, gait());
  EXPECT_NEAR(c.frequency.expected_1_s, 0.3 * 0.2 * 5, 1e-12);
  EXPECT_NEAR(c.frequency.guaranteed_1_s, 0.3 * 0.12 * 5, 1e-12);
  Line line(rules, 5, 3);
  for (std::size_t i = 0; i < 5; ++i) line.z[i] = line.g.integral(line.phi[i]);  // c = 0
  const double rate = measured(line, 80.0, &Line::phases_apart, 1e-8, 1e-3);
  EXPECT_NEAR(rate, c.frequency.expected_1_s, 0.01 * rate);
}

TEST(Certificate, LowPassRateIsMeasuredAndItsBoundEnforced) {
  Rules rules;
  rules.frequency = {.graph = {Topology::all_to_all}, .gain_rad_m_s = 0.3, .low_pass_rad_s = 2.0};
  const Certificate c = certify(rules, 5, gait());
  EXPECT_EQ(c.frequency.guarantee, Guarantee::contracting);  // bound: .3 * .28 * 5 = .42
  EXPECT_NEAR(c.frequency.guaranteed_1_s, 0.3 * 0.12 * 5, 1e-12);
  Line line(rules, 5, 3);
  for (std::size_t i = 0; i < 5; ++i) line.z[i] = line.g.integral(line.phi[i]);
  const double rate = measured(line, 80.0, &Line::phases_apart, 1e-8, 1e-3);
  EXPECT_NEAR(rate, c.frequency.expected_1_s, 0.01 * rate);
  rules.frequency.low_pass_rad_s = 0.41;
  const Certificate slow = certify(rules, 5, gait());
  EXPECT_EQ(slow.frequency.guarantee, Guarantee::none);
  EXPECT_FALSE(slow.holds());
  EXPECT_FALSE(slow.rate_1_s());
  ASSERT_FALSE(slow.frequency.change.empty());
  EXPECT_NE(slow.frequency.change.back().find("above 0.42"), std::string::npos);
}

TEST(Certificate, SaturationNarrowsWhereTheBoundHolds) {
  Rules rules;
  rules.frequency = {.graph = {Topology::all_to_all}, .gain_rad_m_s = 0.3, .saturation_m = 2.0};
  const RuleCertificate c = certify(rules, 5, gait()).frequency;
  EXPECT_NEAR(c.within, 0.5, 1e-12);
  EXPECT_NEAR(c.guaranteed_1_s, 0.3 * 0.12 * 5 * saturate(0.5, 2.0) / 0.5, 1e-12);
}

TEST(Certificate, LeaderIsFollowedAtAlpha) {
  Rules rules;
  rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 0.2, .leader_gain_1_s = 0.25};
  const Certificate c = certify(rules, 5, gait());  // one leads four
  EXPECT_NEAR(c.phase.guaranteed_1_s, 0.2 * 4 + 0.25, 1e-12);
  EXPECT_NEAR(c.tracking.guaranteed_1_s, 0.25, 1e-12);
  EXPECT_NEAR(c.rate_1_s().value(), 0.25, 1e-12);
  rules.phase = {.leader_gain_1_s = 0.25};  // followers hear the leader alone
  EXPECT_NEAR(certify(rules, 5, gait()).phase.guaranteed_1_s, 0.25, 1e-12);
  EXPECT_TRUE(certify(rules, 5, gait()).holds());
}

TEST(Certificate, SaysWhatIsLeftWhenALinkBreaks) {
  Rules rules;
  rules.phase = {.graph = {Topology::ring}, .gain_1_s = 1.5};
  rules.length = {.graph = {Topology::all_to_all}, .gain_1_m = 0.1};
  const Certificate c = certify(rules, 6, gait());
  EXPECT_NEAR(c.phase.without_link_1_s, 1.5 * 2 * (1 - std::cos(M_PI / 6)), 1e-12);  // a chain
  EXPECT_NEAR(c.length.without_link_1_s, c.length.guaranteed_1_s * 4 / 6, 1e-12);
  rules.phase = {.graph = {Topology::star}, .gain_1_s = 1.5};
  EXPECT_EQ(certify(rules, 6, gait()).phase.without_link_1_s, 0.0);
  rules.phase.leader_gain_1_s = 0.4;
  EXPECT_NEAR(certify(rules, 6, gait()).phase.without_link_1_s, 0.4, 1e-12);
}

TEST(Certificate, BeatLeadsAllOfThem) {
  Rules rules;
  rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 0.2};
  GaitRange to_music = gait();
  to_music.beat_gain_1_s = 0.25;
  const Certificate c = certify(rules, 5, to_music);
  EXPECT_NEAR(c.phase.guaranteed_1_s, 0.2 * 5 + 0.25, 1e-12);
  EXPECT_NEAR(c.tracking.guaranteed_1_s, 0.25, 1e-12);
  EXPECT_NEAR(certify(rules, 1, to_music).tracking.guaranteed_1_s, 0.25, 1e-12);
  to_music.beat_gain_1_s = -0.25;
  EXPECT_FALSE(certify(rules, 5, to_music).holds());
}

TEST(Certificate, SaysWhatTheorem6RefusesAndWhatToChange) {
  Rules rules;
  rules.frequency = {.graph = {Topology::chain}, .gain_rad_m_s = 0.3};
  const double beta = 0.12 / 0.28;  // .43: chains of up to 7
  const int most = largest_agents(Topology::chain, beta, Condition::theorem6).value();
  const RuleCertificate good = certify(rules, most, gait()).frequency;
  EXPECT_LT(good.theorem6, 1.0);
  EXPECT_EQ(good.overshoot, 1.0);
  EXPECT_TRUE(good.change.empty());
  EXPECT_EQ(good.largest_agents, most);
  const RuleCertificate more = certify(rules, most + 1, gait()).frequency;
  EXPECT_GE(more.theorem6, 1.0);
  EXPECT_GT(more.overshoot, 1.0);
  EXPECT_EQ(more.guarantee, Guarantee::contracting);
  EXPECT_GT(more.guaranteed_1_s, 0.0);
  ASSERT_EQ(more.change.size(), 2U);
  EXPECT_NE(more.change[0].find("at most N = " + std::to_string(most)), std::string::npos);
}

TEST(Certificate, NothingIsGuaranteedForWhatDivergesOrIsNotConnected) {
  Rules rules;
  rules.frequency = {.graph = {Topology::all_to_all}, .gain_rad_m_s = -0.3};
  EXPECT_EQ(certify(rules, 5, gait()).frequency.guarantee, Guarantee::none);
  rules.frequency.gain_rad_m_s = 0.3;
  rules.frequency.graph = {Topology::weighted, {{0, 1}, {2, 3}}};
  const RuleCertificate parts = certify(rules, 4, gait()).frequency;
  EXPECT_EQ(parts.guarantee, Guarantee::none);
  EXPECT_NE(parts.why.find("lambda_2 = 0"), std::string::npos);
  rules = {};
  rules.length = {.graph = {Topology::ring}, .gain_1_m = -0.1};
  EXPECT_EQ(certify(rules, 5, gait()).length.guarantee, Guarantee::none);
  rules = {};
  rules.phase = {.graph = {Topology::wheel}, .gain_1_s = 1.0};
  EXPECT_EQ(certify(rules, 3, gait()).phase.guarantee, Guarantee::none);  // no wheel of three
  rules.phase = {.graph = {Topology::ring}, .gain_1_s = -1.0};
  EXPECT_EQ(certify(rules, 3, gait()).phase.guarantee, Guarantee::none);
  rules = {};
  rules.heading = {.kind = HeadingKind::consensus, .gain = -1.0};
  EXPECT_EQ(certify(rules, 3, gait()).heading.guarantee, Guarantee::none);
}

TEST(Certificate, OneAloneHasNobodyToAgreeWith) {
  Rules rules;
  rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 1.0};
  rules.length = {.graph = {Topology::all_to_all}, .gain_1_m = 0.1};
  for (const int n : {0, 1}) {
    const Certificate c = certify(rules, n, gait());
    EXPECT_EQ(c.phase.guarantee, Guarantee::off);
    EXPECT_NE(c.phase.why.find("Laplacian is 0"), std::string::npos);
    EXPECT_FALSE(c.rate_1_s());
  }
}

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

TEST(FormationTime, BoundsWhatIsSimulated) {
  for (const Topology topology : {Topology::all_to_all, Topology::ring, Topology::star}) {
    Rules rules;
    rules.phase = {.graph = {topology}, .gain_1_s = 1.0};
    rules.length = {.graph = {topology}, .gain_1_m = 0.08, .limit = 0.4};
    const Certificate c = certify(rules, 6, gait());
    for (unsigned seed = 0; seed < 4; ++seed) {
      Line line(rules, 6, seed);
      line.z[0] += 5.0;  // deep in the clamp
      const double bound = formation_time_s(c, rules, gait(), line.apart(), 0.0, 0.01).value();
      while (line.t < bound) line.step();
      EXPECT_LT(line.apart(), 0.01) << to_string(topology) << ' ' << bound;
      EXPECT_LT(bound, 900.0);
    }
  }
}

TEST(FormationTime, GrowsWithTheErrorAndNeedsTheRightRules) {
  Rules rules;
  rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 1.0};
  rules.length = {.graph = {Topology::all_to_all}, .gain_1_m = 0.08};
  const auto time = [&](double error, double tolerance) {
    return formation_time_s(certify(rules, 6, gait()), rules, gait(), error, 0.0, tolerance);
  };
  EXPECT_GT(time(4.0, 0.01).value(), time(2.0, 0.01).value());
  EXPECT_GT(time(2.0, 0.001).value(), time(2.0, 0.01).value());
  EXPECT_FALSE(time(2.0, 0.0));
  // in the clamp the way is error/limit, at omega <g> = 1 m/s
  EXPECT_NEAR(time(20.0, 0.01).value() - time(10.0, 0.01).value(), 10.0 / 0.5, 1e-9);
  // phases cost (ln (2 pi sqrt 6/(tolerance/4/stretch/g_max)))/rate, and a longest cycle of way
  const double k = 0.08 * 6, limit = 0.5, stretch = 1.5, apart = 20.0 + stretch * 2 * M_PI * 0.28;
  const double phases =
      std::log(2 * M_PI * std::sqrt(6.0) / (0.0025 / (stretch * 0.28))) / (1.0 * 6);
  const double linear = limit / k;
  const double way = (apart - linear) / limit + std::log(linear / 0.005) / k + 2 * M_PI * 0.2;
  EXPECT_NEAR(time(20.0, 0.01).value(), phases + way / (kOmega * 0.2), 1e-9);
  rules.heading = {.kind = HeadingKind::lane, .gain = 1.5, .ahead_m = 2.0};
  const auto with_lane = [&](double lane) {
    return formation_time_s(certify(rules, 6, gait()), rules, gait(), 20.0, lane, 0.01).value();
  };
  // a lane 3 m away is 3 tan(half the slope) of way lost, and turning g/m_psi ln 2
  const double lost = 3 * std::tan(0.5 * std::atan(1.5)), turn = 1.5 * 0.2 / 1.5 * std::log(2.0);
  const double rate = certify(rules, 6, gait()).heading.expected_1_s;
  const double lanes = std::log(2 * M_PI * 3.0 / 0.01) / rate;
  EXPECT_NEAR(with_lane(3.0), lanes + (way + (lost + turn) / limit) / (kOmega * 0.2), 1e-9);
  rules.heading = {};
  rules.phase = {};
  EXPECT_FALSE(time(2.0, 0.01));
}

TEST(FormationTime, OfARingIsThatOfItsEnergy) {  // λ⁺ = 1, λ_max = 4
  Rules rules;
  rules.phase = {.graph = {Topology::ring}, .gain_1_s = 2.0};
  rules.length = {.graph = {Topology::ring}, .gain_1_m = 0.08, .limit = 0.4};
  const Certificate c = certify(rules, 6, gait());
  const double stretch = 1.4, shift = stretch * 2 * M_PI * 0.28;
  const double phases = std::log(2 * M_PI * std::sqrt(6.0) / (0.0025 / (stretch * 0.28))) / 2.0;
  const auto time = [&](double root_v) {  // √V at the start; √(λ_max n/8) = √3
    const double begin = root_v + std::sqrt(3.0) * shift;
    const double linear = std::min(begin, 0.4 / 0.08 / std::sqrt(2.0));
    const double way = (begin - linear) / (0.4 * std::sqrt(0.5)) +
                       std::log(linear / (0.005 * 0.5)) / 0.08 + 2 * M_PI * 0.2;
    return phases + way / (kOmega * 0.2);
  };
  EXPECT_NEAR(formation_time_s(c, rules, gait(), 3.0, 0.0, 0.01).value(),
              time(std::sqrt(3.0) * 3.0), 1e-9);
  const std::vector<double> ahead{3.0, 2.0, 1.0, 0.0, 1.0, 2.0};  // six links of 1 m
  EXPECT_NEAR(formation_time_s(c, rules, gait(), 3.0, 0.0, 0.01, ahead).value(),
              time(std::sqrt(0.5 * 6.0)), 1e-9);
  const std::vector<double> apart{3.0, 0.0, 3.0, 0.0, 3.0, 0.0};  // the worst there is
  EXPECT_NEAR(formation_time_s(c, rules, gait(), 3.0, 0.0, 0.01, apart).value(),
              time(std::sqrt(3.0) * 3.0), 1e-9);
}

TEST(Certificate, HeadingsComeToTheirGoalsAsFastAsGuaranteedWhileThoseAreFar) {
  Rules rules;
  rules.heading = {.kind = HeadingKind::goal, .gain = 1.5};
  const RuleCertificate c = certify(rules, 1, gait()).heading;
  const double fastest = kOmega * 0.28;
  EXPECT_DOUBLE_EQ(c.expected_1_s, 1.5);
  EXPECT_NEAR(c.guaranteed_1_s, 1.5 - fastest / c.beyond_m, 1e-12);
  // Who goes straight to its goal, off by e, at the largest speed: tan(e/2) never decays slower.
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

TEST(Certificate, NotesWhereRulesAreAtOdds) {
  Rules rules;
  rules.frequency = {.graph = {Topology::all_to_all}, .gain_rad_m_s = 0.3};
  const Certificate alone = certify(rules, 5, gait());
  EXPECT_NEAR(alone.residual_m, 0.08, 1e-4);  // of −(.08/2) cos 2φ
  rules.phase = {.graph = {Topology::ring}, .gain_1_s = 1.0};
  const Certificate odds = certify(rules, 5, gait());
  EXPECT_EQ(odds.residual_m, 0.0);
  ASSERT_EQ(odds.notes.size(), 1U);
  EXPECT_NE(odds.notes[0].find("I and III"), std::string::npos);
  rules.length = {.graph = {Topology::ring}, .gain_1_m = 0.1};
  EXPECT_TRUE(certify(rules, 5, gait()).notes.empty());
}

}  // namespace
}  // namespace mimesis::crowd
