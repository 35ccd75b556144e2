// How long until a formation stands, at most.
#include <gtest/gtest.h>

#include <cmath>

#include "nodes/crowd/certificate/test/line.h"

namespace mimesis::crowd {
namespace {

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

}  // namespace
}  // namespace mimesis::crowd
