#include "nodes/crowd/certificate/certificate.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "nodes/crowd/certificate/contraction.h"
#include "nodes/crowd/certificate/rate_fit.h"
#include "nodes/crowd/certificate/test/line.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {
namespace {

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

TEST(Certificate, StepsOfTheEngineFollowNoRateAboveAFifth) {
  GaitRange walk = gait();
  walk.step_s = 0.02;
  Rules rules;
  for (const double gain : {0.1, 1.9, 2.1, 5.0}) {  // decays by 5 times that: 0.5 a step at most
    rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = gain};
    const RuleCertificate c = certify(rules, 5, walk).phase;
    EXPECT_NEAR(c.guaranteed_1_s, std::min(5.0 * gain, 0.2 / 0.02), 1e-12);
    EXPECT_EQ(c.expected_1_s, 5.0 * gain);
    EXPECT_EQ(c.why.find("steps of 0.02 s") != std::string::npos, gain > 2.0) << c.why;
  }
}

TEST(Certificate, StepLengthConvergesAtTheAveragedRateOncePhasesAgree) {
  for (const Topology topology : {Topology::ring, Topology::all_to_all}) {
    Rules rules;
    rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 2.0};
    rules.length = {.graph = {topology}, .gain_1_m = 0.1};
    const Certificate c = certify(rules, 6, gait());
    Line line(rules, 6, 2);
    const double rate = measured(line, 120.0, &Line::apart, 1e-8, 1e-3);
    EXPECT_NEAR(rate, c.length.expected_1_s, 0.01 * rate) << to_string(topology);
    EXPECT_DOUBLE_EQ(c.length.guaranteed_1_s, c.length.expected_1_s);
    rules.phase.gain_1_s = 0.01;  // slower than step lengths, which wait for it
    EXPECT_NEAR(certify(rules, 6, gait()).length.guaranteed_1_s, 0.06, 1e-12);
    rules.phase = {};  // phases differ: that of a cycle's mean but for its swing
    const double alone = certify(rules, 6, gait()).length.guaranteed_1_s / c.length.expected_1_s;
    EXPECT_GT(alone, 0.8);
    EXPECT_LT(alone, 1.0);
    rules.length = {.graph = {topology}, .gain_1_m = 1.0};  // too fast for means: by the slowest
    EXPECT_NEAR(certify(rules, 6, gait()).length.guaranteed_1_s, c.length.expected_1_s * 6.0,
                1e-12);
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

TEST(Certificate, IIIandIIIAreNoHierarchy) {  // a = b = c = 1 and b = 3: s² − (2 + b) s + 1 = 0
  const GaitRange even{SpeedFunction(0.2, {}, {}), kOmega};
  for (const Topology topology : {Topology::all_to_all, Topology::ring}) {
    Rules rules;
    const double lambda = extremes(topology, 5).least;
    rules.phase = {.graph = {topology}, .gain_1_s = 1.0 / lambda};
    rules.length = {.graph = {topology}, .gain_1_m = 1.0 / (kOmega * 0.2 * lambda)};
    for (const double b : {1.0, 3.0}) {
      rules.frequency = {.graph = {topology}, .gain_rad_m_s = b / (0.2 * lambda)};
      const Certificate c = certify(rules, 5, even);
      const double slow = 0.5 * (2.0 + b - std::sqrt((2.0 + b) * (2.0 + b) - 4.0));
      EXPECT_NEAR(c.rate_1_s().value(), slow, 1e-6);  // .382, .209
      for (const auto* rule : {&c.frequency, &c.length, &c.phase}) {
        EXPECT_EQ(rule->guaranteed_1_s, c.rate_1_s());
        EXPECT_TRUE(rule->in_the_end);
      }
      Line line(rules, 5, 4);
      line.g = even.gait;
      const double rate = measured(line, 60.0, &Line::apart, 1e-7, 1e-3);
      EXPECT_NEAR(rate, slow, 0.02 * slow) << to_string(topology) << ' ' << b;
    }
    rules.phase.graph = {Topology::star};
    EXPECT_EQ(certify(rules, 5, even).phase.guarantee, Guarantee::none) << "different graphs";
  }
}

TEST(Certificate, NothingIsPromisedWithoutABound) {
  Rules rules;
  rules.frequency = {.graph = {Topology::all_to_all}, .gain_rad_m_s = 0.3, .saturation_m = 2.0};
  EXPECT_EQ(certify(rules, 5, gait()).frequency.guarantee, Guarantee::none);
  rules.frequency.saturation_m = 0.0;
  rules.length = {.graph = {Topology::all_to_all}, .gain_1_m = 0.1};
  EXPECT_FALSE(certify(rules, 5, gait()).holds());  // I and II without III
  rules.frequency = {};
  EXPECT_TRUE(certify(rules, 5, gait()).holds());
  GaitRange turned = gait();
  turned.off_path_rad = 0.5;
  EXPECT_EQ(certify(rules, 5, turned).length.guarantee, Guarantee::none);  // no cos psi
  rules.heading = {.kind = HeadingKind::consensus, .gain = 1.0};
  EXPECT_EQ(certify(rules, 5, gait()).length.guarantee, Guarantee::none);
}

TEST(Certificate, LeaderIsFollowedAtAlpha) {
  Rules rules;
  rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 0.2, .leader_gain_1_s = 0.25};
  const Certificate c = certify(rules, 5, gait());  // one leads four
  EXPECT_NEAR(c.phase.guaranteed_1_s, 0.2 * 4 + 0.25, 1e-12);
  // All-to-all who is far off is pulled less than by alpha: (k N + alpha) atan2(..)/e.
  EXPECT_NEAR(c.tracking.expected_1_s, 0.25, 1e-12);
  EXPECT_NEAR(c.tracking.guaranteed_1_s, 0.25 * std::cos(c.tracking.within), 1e-12);
  EXPECT_GT(c.tracking.within, 0.0);
  EXPECT_EQ(c.rate_1_s().value(), c.tracking.guaranteed_1_s);
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
  to_music.beat_rate_rad_s = to_music.eigenfrequency_rad_s;
  const Certificate c = certify(rules, 5, to_music);
  EXPECT_NEAR(c.phase.guaranteed_1_s, 0.2 * 5 + 0.25, 1e-12);
  EXPECT_NEAR(c.tracking.expected_1_s, 0.25, 1e-12);
  EXPECT_NEAR(certify(rules, 1, to_music).tracking.expected_1_s, 0.25, 1e-12);
  to_music.beat_gain_1_s = -0.25;
  EXPECT_FALSE(certify(rules, 5, to_music).holds());
}

/// Where z − d is the way of the phase, places are taken when phases agree: the bound of rule I
/// holds from the first moment.
TEST(Certificate, AgentsFromOutsideMakeItSlowerByTheirAge) {
  for (const double stiffness : {0.5, 1.0, 2.0}) {
    for (const double age_s : {0.0, 0.02, 0.1, 0.3}) {
      const double r = late_rate(stiffness, stiffness, age_s), x = stiffness * age_s;
      const double off = 0.5 * x * x * (1.0 + x) * (1.0 + x);
      const double adds = stiffness * (2.0 * off + x * (1.0 + off)) * std::exp(3.0 * age_s * r);
      EXPECT_NEAR(r, adds < stiffness || r > 0.0 ? stiffness - adds : 0.0, 1e-9);
    }
  }
  EXPECT_EQ(late_rate(1.0, 2.0, 0.5), 0.0);
  GaitRange walk = gait();
  walk.guests = 2;
  walk.age_s = 0.3;
  Rules rules;
  rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 0.25};
  rules.length = {.graph = {Topology::all_to_all}, .gain_1_m = 0.1};
  const Certificate c = certify(rules, 6, walk);
  EXPECT_GT(c.phase.guaranteed_1_s, 0.0);
  EXPECT_LE(c.length.guaranteed_1_s, c.phase.guaranteed_1_s) << "II waits for III";
  EXPECT_GT(c.length.remains, 0.0);
  rules.frequency = {.graph = {Topology::all_to_all}, .gain_rad_m_s = 0.1};
  EXPECT_FALSE(certify(rules, 6, walk).holds()) << "no bound of the loop with delays";
}

TEST(Certificate, DifferencesNeverGrowBeyondTheOvershoot) {
  for (unsigned seed = 0; seed < 40; ++seed) {
    const int n = 2 + static_cast<int>(seed % 9);
    Rules rules;
    rules.frequency = {.graph = {Topology::chain}, .gain_rad_m_s = 0.3};
    const RuleCertificate c = certify(rules, n, gait()).frequency;
    Line line(rules, n, seed);
    for (double& phi : line.phi) phi *= 5.0;
    std::ranges::transform(line.phi, line.z.begin(),
                           [&](double phi) { return line.g.integral(phi); });
    const auto error = [&] {
      const Eigen::Map<const Eigen::ArrayXd> phi(line.phi.data(), n);
      return (phi - phi.mean()).matrix().norm();
    };
    const double first = error();
    while (line.t < 20.0) {
      line.step();
      const double share = error() / first * std::exp(c.guaranteed_1_s * line.t);
      ASSERT_LE(share, c.overshoot * 1.001) << n << " agents at " << line.t;
    }
  }
}

TEST(Certificate, SaysWhatTheorem6RefusesAndWhatToChange) {
  Rules rules;
  rules.frequency = {.graph = {Topology::chain}, .gain_rad_m_s = 0.3};
  const double beta = 0.12 / 0.28;  // .43: chains of up to 7
  const int most = largest_agents(Topology::chain, beta, Condition::theorem6).value();
  const RuleCertificate good = certify(rules, most, gait()).frequency;
  EXPECT_LT(good.theorem6, 1.0);
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

TEST(Certificate, NotesWhereRulesAreAtOdds) {
  Rules rules;
  rules.frequency = {.graph = {Topology::all_to_all}, .gain_rad_m_s = 0.3};
  const Certificate alone = certify(rules, 5, gait());
  ASSERT_EQ(alone.notes.size(), 1U);
  EXPECT_NE(alone.notes[0].find("oscillating"), std::string::npos);
  rules.phase = {.graph = {Topology::ring}, .gain_1_s = 1.0};
  const Certificate odds = certify(rules, 5, gait());
  EXPECT_FALSE(odds.holds());
  EXPECT_NE(odds.notes.back().find("I and III"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::crowd
