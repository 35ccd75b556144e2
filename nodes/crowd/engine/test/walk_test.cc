#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <vector>

#include "common/math/circle.h"
#include "common/parallel/team.h"
#include "nodes/crowd/engine/crowd.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {
namespace {

SpeedFunction gait() {
  const std::vector<double> cosine{0.02, 0.05}, sine{0.01, -0.03};
  return {0.22, cosine, sine};
}

GroupSettings group(const Rules& rules, const Path& path = {}) { return {rules, gait(), path}; }

std::vector<Agent> agents(int n, unsigned seed, double phase_spread, double place_spread) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Agent> all(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    Agent& a = all[static_cast<std::size_t>(i)];
    a.id = static_cast<AgentId>(10 + 3 * i);
    a.traits.omega_rad_s = 6.0;
    a.traits.place_m = -1.5 * i;
    a.traits.lane_m = 0.5 * i;
    a.state.phase_rad = phase_spread * unit(random);
    a.state.position_W_m = {a.traits.place_m + place_spread * unit(random), a.traits.lane_m};
  }
  return all;
}

double spread(const Crowd& crowd, int n) {
  std::vector<double> e(static_cast<std::size_t>(n));
  crowd.spacing(0, e);
  return *std::ranges::max_element(e) - *std::ranges::min_element(e);
}

/// Decay of `measure` from t1 to t2 [1/s].
template <class F>
double decay(Crowd& crowd, double t1, double t2, F measure) {
  while (crowd.time_s() < t1 - 1e-9) crowd.step();
  const double before = measure();
  const double from = crowd.time_s();
  while (crowd.time_s() < t2 - 1e-9) crowd.step();
  return std::log(before / measure()) / (crowd.time_s() - from);
}

Rules phase_rules(Topology topology, double k, double alpha = 0.0) {
  Rules rules;
  rules.phase = {{topology}, k, alpha};
  return rules;
}

TEST(Walk, OneAgentGoesTheIntegralOfItsSpeedFunction) {
  Crowd crowd({.dt_s = 0.05});
  crowd.add_group(group({}, {{3.0, 4.0}, 0.7}));
  Agent a{.id = 1};
  a.traits.omega_rad_s = 5.5;
  a.traits.stride = 1.2;
  a.state.phase_rad = 0.4;
  a.state.heading_rad = 0.7;
  crowd.add(0, std::span(&a, 1));
  for (int i = 0; i < 100; ++i) crowd.step();
  const SpeedFunction g = gait();
  const double way = static_cast<float>(1.2) * (g.integral(0.4 + 5.5 * 5.0) - g.integral(0.4));
  const Agent b = *crowd.find(1);
  EXPECT_NEAR(b.state.position_W_m.x(), way * std::cos(0.7), 1e-11);
  EXPECT_NEAR(b.state.position_W_m.y(), way * std::sin(0.7), 1e-11);
  EXPECT_NEAR(b.state.phase_rad, 0.4 + 27.5, 1e-12);
  const double v = static_cast<float>(1.2) *
                   (g.integral(b.state.phase_rad) - g.integral(b.state.phase_rad - 0.275)) / 0.05;
  EXPECT_NEAR(b.state.velocity_W_m_s.norm(), v, 1e-6);
}

TEST(Walk, PhasesSynchroniseAtTheRatesOfTable41) {  // kλ⁺ = 1.2 [1/s]
  constexpr int kN = 8;
  const double pi = std::numbers::pi;
  const std::vector<std::pair<Topology, double>> graphs{
      {Topology::chain, 2.0 - 2.0 * std::cos(pi / kN)},
      {Topology::ring, 2.0 - 2.0 * std::cos(2.0 * pi / kN)},
      {Topology::star, 1.0},
      {Topology::all_to_all, kN}};
  for (const auto& [topology, lambda] : graphs) {
    Crowd crowd({.dt_s = 0.005});
    crowd.add_group(group(phase_rules(topology, 1.2 / lambda)));
    crowd.add(0, agents(kN, 7, 0.3, 0.0));
    const double rate = decay(crowd, 5.0, 8.0, [&] { return dispersion(crowd.phase_rad()); });
    EXPECT_NEAR(rate, 1.2, 0.012) << to_string(topology);
  }
}

TEST(Walk, FollowersAgreeAtKnAlphaAndReachTheLeaderAtAlpha) {
  for (const Topology topology : {Topology::all_to_all, Topology::ring}) {
    Crowd crowd({.dt_s = 0.01});
    crowd.add_group(group(phase_rules(topology, 0.2, 0.25)));
    crowd.add(0, agents(6, 3, 0.4, 0.0));
    const auto followers = [&] { return dispersion(crowd.phase_rad().subspan(1)); };
    const auto behind = [&] {
      return std::abs(math::wrap_pi(crowd.phase_rad()[0] - crowd.phase_rad()[1]));
    };
    const double ring = 2.0 - 2.0 * std::cos(math::kTwoPi / 5);
    const double lambda = topology == Topology::ring ? ring : 5.0;
    EXPECT_NEAR(decay(crowd, 4.0, 6.0, followers), 0.2 * lambda + 0.25, 0.02);
    EXPECT_NEAR(decay(crowd, 25.0, 35.0, behind), 0.25, 0.005);
    EXPECT_DOUBLE_EQ(crowd.phase_rate_rad_s()[0], 6.0);  // the leader is not pulled
  }
}

TEST(Walk, ARhythmFromOutsideLeads) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(group(phase_rules(Topology::all_to_all, 0.1, 0.5)));
  crowd.add(0, agents(5, 3, 3.0, 0.0));
  for (int i = 0; i < 2000; ++i) {
    crowd.set_beat(0, 6.0 * crowd.time_s() + 1.0);
    crowd.step();
  }
  for (const double phi : crowd.phase_rad()) {
    EXPECT_NEAR(math::wrap_pi(phi - 6.0 * crowd.time_s() - 1.0), 0.0, 1e-6);
  }
}

TEST(Walk, EveryStartSynchronises) {
  for (const Topology topology :
       {Topology::chain, Topology::ring, Topology::star, Topology::wheel, Topology::all_to_all}) {
    int in = 0;
    for (unsigned seed = 0; seed < 100; ++seed) {
      Crowd crowd({.dt_s = 0.05});
      crowd.add_group(group(phase_rules(topology, topology == Topology::all_to_all ? 0.2 : 1.0)));
      crowd.add(0, agents(8, seed, std::numbers::pi, 0.0));
      for (int i = 0; i < 2400; ++i) crowd.step();
      in += mimesis::crowd::spread(crowd.phase_rad()) <= 1e-3;
    }
    EXPECT_EQ(in, 100) << to_string(topology);
  }
}

TEST(Walk, StepFrequencyMakesTheFormationAtMgLambda) {  // rate m_d <g> λ⁺ [crowd.md B3]
  Rules rules;
  rules.frequency = {{Topology::all_to_all}, 0.5};
  Crowd crowd({.dt_s = 0.01});
  crowd.add_group(group(rules));
  auto all = agents(9, 5, 0.3, 0.0);
  for (Agent& a : all) a.state.position_W_m.x() += gait().integral(a.state.phase_rad);
  crowd.add(0, all);
  const double rate = decay(crowd, 2.0 * math::kTwoPi / 6.0, 5.0 * math::kTwoPi / 6.0,
                            [&] { return spread(crowd, 9); });
  EXPECT_NEAR(rate, 0.5 * 0.22 * 9, 0.01 * 0.99);
}

TEST(Walk, StepLengthMakesTheFormationAtMOmegaGN) {  // rate m_z ω <g> N [crowd.md B3]
  Rules rules;
  rules.length = {{Topology::all_to_all}, 0.095, 0.5};
  Crowd crowd({.dt_s = 0.0104719755});
  crowd.add_group(group(rules));
  crowd.add(0, agents(9, 5, 0.0, 0.3));
  const double rate = decay(crowd, 2.0 * math::kTwoPi / 6.0, 5.0 * math::kTwoPi / 6.0,
                            [&] { return spread(crowd, 9); });
  EXPECT_NEAR(rate, 0.095 * 6.0 * 0.22 * 9, 0.01 * 1.13);
}

/// Error after 1 s of a rule that halves its error exponentially at `rate` [1/s].
double error_after_a_second(const Rules& rules, double dt, double rate, bool of_phase) {
  Crowd crowd({.dt_s = dt});
  crowd.add_group({rules, SpeedFunction(0.22, {}, {}), {}});
  auto all = agents(2, 1, 0.0, 0.0);
  all[0].state.phase_rad = of_phase ? 0.2 : 0.0;
  all[0].state.position_W_m.x() += of_phase ? 0.0 : 0.2;
  crowd.add(0, all);
  while (crowd.time_s() < 1.0 - 1e-9) crowd.step();
  const double left = of_phase ? crowd.phase_rad()[0] - crowd.phase_rad()[1] : spread(crowd, 2);
  return std::abs(left - 0.2 * std::exp(-rate));
}

TEST(Walk, WhoIsFarAheadWaitsAndDoesNotWalkBackwards) {  // as in dance.yaml: 2.3 rad, 3.5 1/s
  Crowd crowd({.dt_s = 0.01});
  Rules rules = phase_rules(Topology::all_to_all, 0.1, 3.4);
  rules.heading = {.kind = HeadingKind::lane, .gain = 1.2, .ahead_m = 1.0};
  crowd.add_group(group(rules));
  std::vector<Agent> two = agents(2, 1, 0.0, 0.0);
  two[1].state.phase_rad = 2.3;
  two[1].state.heading_rad = 0.5;
  two[1].traits.lane_m = 0.0;
  two[1].state.position_W_m.y() = 0.0;
  crowd.add(0, two);
  for (int i = 0; i < 100; ++i) {
    crowd.step();
    EXPECT_GE(crowd.phase_rate_rad_s()[1], 0.0);
    EXPECT_LE(crowd.heading_rad()[1], 0.5) << "turns away from its lane";
  }
}

TEST(Walk, ErrorsAreOfOrderTwoInTheStep) {
  Rules length;
  length.length = {{Topology::all_to_all}, 1.5 / (2 * 6.0 * 0.22), 0.9};
  const struct {
    Rules rules;
    double rate;
    bool of_phase;
  } cases[] = {{phase_rules(Topology::all_to_all, 0.75), 1.5, true}, {length, 1.5, false}};
  for (const auto& c : cases) {
    const double coarse = error_after_a_second(c.rules, 0.05, c.rate, c.of_phase);
    const double fine = error_after_a_second(c.rules, 0.0125, c.rate, c.of_phase);
    EXPECT_GT(coarse / fine, 11.0) << c.of_phase;  // 16 in the limit, 4 for order one
    EXPECT_LT(fine, 2e-5) << c.of_phase;
  }
}

TEST(Walk, SparseGraphsAndMeanFieldsAgreeWhereTheyAreTheSame) {
  // All-to-all as a list of edges; phases are near, so that wrapping does not matter.
  constexpr int kN = 7;
  GraphSettings complete{Topology::weighted, {}};
  for (int i = 0; i < kN; ++i) {
    for (int j = i + 1; j < kN; ++j) complete.edges.push_back({i, j, 1.0});
  }
  std::vector<Agent> result[2];
  for (const bool sparse : {false, true}) {
    const GraphSettings graph = sparse ? complete : GraphSettings{Topology::all_to_all};
    Rules rules;
    rules.frequency = {graph, 0.03, 0.5, 2.0};
    rules.length = {graph, 0.02, 0.4};
    rules.phase = {graph, 0.1};
    rules.heading = {HeadingKind::coupled, graph, 0.1};
    Crowd crowd({.dt_s = 0.02});
    crowd.add_group(group(rules, {{0.0, 0.0}, 0.2}));
    auto all = agents(kN, 11, 0.02, 1.0);
    for (Agent& a : all) a.state.heading_rad = 0.2 + 0.3 * a.state.phase_rad;
    crowd.add(0, all);
    for (int i = 0; i < 200; ++i) crowd.step();
    for (int i = 0; i < kN; ++i) result[sparse].push_back(crowd.agent(i));
  }
  for (std::size_t i = 0; i < kN; ++i) {
    const AgentState &a = result[0][i].state, &b = result[1][i].state;
    EXPECT_NEAR((a.position_W_m - b.position_W_m).norm(), 0.0, 1e-4);
    EXPECT_NEAR(a.phase_rad, b.phase_rad, 1e-4);  // directions of Σ e^{iφ}, not the mean
    EXPECT_NEAR(a.heading_rad, b.heading_rad, 1e-10);
    EXPECT_NEAR(a.smoothed_error_m, b.smoothed_error_m, 1e-3);
  }
}

TEST(Walk, LanesAreReachedAndKept) {
  Rules rules;
  rules.heading = {.kind = HeadingKind::lane, .gain = 1.0, .ahead_m = 2.0};
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(group(rules, {{1.0, 2.0}, 0.5}));
  auto all = agents(4, 2, 1.0, 1.0);
  crowd.add(0, all);
  for (int i = 0; i < 3000; ++i) crowd.step();
  for (int i = 0; i < 4; ++i) {
    const Agent a = crowd.agent(i);
    const Eigen::Vector2d p = a.state.position_W_m - Eigen::Vector2d(1.0, 2.0);
    EXPECT_NEAR(-std::sin(0.5) * p.x() + std::cos(0.5) * p.y(), a.traits.lane_m, 1e-6);
    EXPECT_NEAR(a.state.heading_rad, 0.5, 1e-6);
  }
}

TEST(Walk, HeadingsAgreeInConsensusAndGoalsAreReached) {
  Rules rules;
  rules.heading = {.kind = HeadingKind::consensus, .low_pass_s = 0.5};
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(group(rules));
  auto all = agents(5, 9, 2.0, 0.0);
  for (Agent& a : all) a.state.heading_rad = a.state.phase_rad;
  crowd.add(0, all);
  for (int i = 0; i < 1000; ++i) crowd.step();
  EXPECT_LT(mimesis::crowd::spread(crowd.heading_rad()), 1e-6);

  rules.heading = {.kind = HeadingKind::goal};
  crowd.set_rules(0, rules);
  for (Agent& a : all) {
    a.traits.goal_W_m = {100.0, 3.0};
    ASSERT_TRUE(crowd.set_traits(a.id, a.traits));
  }
  for (int i = 0; i < 10'000; ++i) crowd.step();
  for (int i = 0; i < 5; ++i) {
    EXPECT_LT((crowd.agent(i).state.position_W_m - Eigen::Vector2d(100.0, 3.0)).norm(), 0.05);
  }
}

TEST(Walk, ALeaderSomeTurnsAwayLeadsAsOneInTheSameTurn) {
  Rules rules;
  rules.phase = {.graph = {Topology::ring}, .gain_1_s = 0.5, .leader_gain_1_s = 0.8};
  std::vector<Crowd> crowds;
  for (int k = 0; k < 2; ++k) {
    crowds.emplace_back(CrowdSettings{.dt_s = 0.01});
    crowds[std::size_t(k)].add_group({rules, SpeedFunction(0.2, {}, {}), {}});
    std::vector<Agent> agents(4);
    for (std::size_t i = 0; i < 4; ++i) {
      agents[i].id = i + 1;
      agents[i].traits.omega_rad_s = 6.0;
      agents[i].state.phase_rad = 0.4 * static_cast<double>(i);
    }
    crowds[std::size_t(k)].add(0, agents);
  }
  for (int i = 0; i < 500; ++i) {
    for (int k = 0; k < 2; ++k) {
      Crowd& c = crowds[std::size_t(k)];
      c.set_beat(0, 6.0 * c.time_s() + 1.0 - 3 * k * math::kTwoPi);
      c.step();
    }
  }
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(crowds[0].phase_rad()[i], crowds[1].phase_rad()[i], 1e-9);
    EXPECT_NEAR(crowds[0].phase_rad()[i], 6.0 * crowds[0].time_s() + 1.0, 0.05);
  }
}

// ψ̇ = ω (−m sin ψ + g^ψ(φ)) near a goal that stays: every harmonic aₖ e^{ikφ} ends up as
// aₖ e^{ikφ}/(m + ik).
TEST(Sway, HeadingsFollowItAsTheLinearDynamicsDoes) {
  const double m = 0.8, omega = 6.0;
  const std::vector<double> cosine{0.012, -0.004, 0.0, 0.002}, sine{-0.006, 0.003, 0.005, 0.0};
  Rules rules;
  rules.heading = {.kind = HeadingKind::lane, .gain = m, .ahead_m = 1e9};
  Crowd crowd({.dt_s = 0.002});
  const HeadingSway sway = HeadingSway::make(cosine, sine);
  crowd.add_group({rules, SpeedFunction(0.2, {}, {}), {{0.0, 0.0}, 0.3}, sway});
  rules.heading.kind = HeadingKind::goal;  // which does not sway
  crowd.add_group({rules, SpeedFunction(0.2, {}, {}), {{0.0, 0.0}, 0.3}, sway});
  for (int group = 0; group < 2; ++group) {
    Agent a{.id = static_cast<AgentId>(group + 1)};
    a.traits.omega_rad_s = omega;
    a.state.heading_rad = 0.3;
    a.traits.goal_W_m = 1e9 * Eigen::Vector2d(std::cos(0.3), std::sin(0.3));
    crowd.add(group, std::vector<Agent>{a});
  }
  for (int i = 0; i < 10000; ++i) {
    crowd.step();
    if (i < 5000) continue;
    const double phi = crowd.phase_rad()[0];
    double wanted = 0.3;
    for (int k = 1; k <= 4; ++k) {
      const auto h = static_cast<std::size_t>(k - 1);
      const std::complex<double> a(cosine[h], -sine[h]);
      wanted += (a * std::polar(1.0, k * phi) / std::complex<double>(m, k)).real();
    }
    ASSERT_NEAR(crowd.heading_rad()[0], wanted, 1e-5);
  }
  EXPECT_NEAR(crowd.heading_rad()[1], 0.3, 1e-9);
  crowd.set_gait(0, SpeedFunction(0.2, {}, {}));
  for (int i = 0; i < 3000; ++i) crowd.step();
  EXPECT_NEAR(crowd.heading_rad()[0], 0.3, 1e-6);
}

}  // namespace
}  // namespace mimesis::crowd
