#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/testing/refusal.h"
#include "nodes/crowd/engine/crowd.h"

namespace mimesis::crowd {
namespace {

SpeedFunction plain_gait() {
  const std::vector<double> cosine{0.02, 0.05}, sine{0.01, -0.03};
  return {0.22, cosine, sine};
}

std::vector<Agent> some_agents(int n) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Agent> all(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    Agent& a = all[static_cast<std::size_t>(i)];
    a.id = static_cast<AgentId>(i + 1);
    a.traits.omega_rad_s = 6.0;
    a.traits.place_m = -1.5 * (i / 6);
    a.traits.lane_m = 1.2 * (i % 6);
    a.state.phase_rad = 2.0 * unit(random);
    a.state.position_W_m = {a.traits.place_m + 0.2 * unit(random), a.traits.lane_m};
  }
  return all;
}

Rules all_rules(Topology topology) {
  Rules rules;
  rules.frequency = {{topology}, 0.02, 1.0, 3.0};
  rules.length = {{Topology::all_to_all}, 0.005, 0.4};
  rules.phase = {{topology}, 0.03, 0.3};
  rules.heading = {.kind = HeadingKind::lane, .avoid = true};
  return rules;
}

TEST(Members, AnAgentGoesOnAsItWasWhereverItIsAdded) {
  Crowd one({.dt_s = 0.02}), other({.dt_s = 0.02});
  for (Crowd* c : {&one, &other}) c->add_group({all_rules(Topology::none), plain_gait(), {}});
  const auto all = some_agents(1);
  one.add(0, all);
  for (int i = 0; i < 100; ++i) one.step();
  const Agent left = *one.find(1);
  other.add(0, std::span(&left, 1));
  for (int i = 0; i < 100; ++i) {
    one.step();
    other.step();
  }
  const AgentState a = one.find(1)->state, b = other.find(1)->state;
  EXPECT_NEAR((a.position_W_m - b.position_W_m).norm(), 0.0, 1e-12);  // turns of φ were taken off
  EXPECT_NEAR(a.heading_rad, b.heading_rad, 1e-12);
}

TEST(Members, WhoLeavesAChainLeavesNoGap) {
  Rules rules;
  rules.phase = {{Topology::chain}, 1.0};
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group({rules, plain_gait(), {}});
  crowd.add(0, some_agents(9));
  crowd.step();
  EXPECT_EQ(crowd.remove(5), 1);
  EXPECT_EQ(crowd.remove(5), 0);
  EXPECT_EQ(crowd.size(), 8);
  EXPECT_FALSE(crowd.find(5).has_value());
  for (int i = 0; i < 8000; ++i) crowd.step();
  for (const double phi : crowd.phase_rad()) EXPECT_NEAR(phi, crowd.phase_rad()[0], 1e-6);
}

TEST(Members, EdgesOfAWeightedGraphStayBetweenTheSameAgents) {
  Rules rules;
  rules.phase = {{Topology::weighted, {{0, 1, 1.0}, {2, 3, 2.0}, {3, 4, 1.0}}}, 1.0};
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group({rules, plain_gait(), {}});
  crowd.add(0, some_agents(5));
  crowd.step();
  crowd.remove(2);  // node 1
  crowd.step();
  const double alone = crowd.find(1)->state.phase_rad;
  for (int i = 0; i < 1000; ++i) crowd.step();
  const auto phase = [&](AgentId id) { return crowd.find(id)->state.phase_rad; };
  EXPECT_NEAR(phase(3), phase(4), 1e-6);
  EXPECT_NEAR(phase(4), phase(5), 1e-6);
  EXPECT_NEAR(math::wrap_pi(phase(1) - alone - 6.0 * 20.0), 0.0, 1e-9);
  EXPECT_GT(std::abs(math::wrap_pi(phase(1) - phase(3))), 0.01);
  // Edges to unknown agents are refused before anything changes.
  rules.phase.graph.edges = {{0, 7, 1.0}};
  EXPECT_THROW(crowd.set_rules(0, rules), ConfigError);
  EXPECT_EQ(crowd.group(0).rules.phase.graph.edges.size(), 2U);
}

TEST(Members, TheNextLeadsWhenTheLeaderLeaves) {
  Rules rules;
  rules.phase = {{Topology::all_to_all}, 0.1, 0.5};
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group({rules, plain_gait(), {}});
  crowd.add(0, some_agents(4));
  crowd.step();
  crowd.remove(1);
  for (int i = 0; i < 2000; ++i) crowd.step();
  EXPECT_DOUBLE_EQ(crowd.find(2)->state.phase_rate_rad_s, 6.0);
  for (const double phi : crowd.phase_rad()) {
    EXPECT_NEAR(math::wrap_pi(phi - crowd.find(2)->state.phase_rad), 0.0, 1e-6);
  }
}

TEST(Members, WhoIsNotTrustedIsSeenButNotCoupled) {
  Rules rules;
  rules.phase = {{Topology::all_to_all}, 0.2};
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group({rules, plain_gait(), {}});
  auto all = some_agents(4);
  all[2].role = Role::external;
  all[2].state.phase_rate_rad_s = 5.0;
  crowd.add(0, all);
  crowd.step();
  // The rules do not move it, but compute its command.
  EXPECT_NEAR(crowd.find(3)->state.phase_rate_rad_s, 5.0, 0.0);
  const auto wish = crowd.wish(3);
  ASSERT_TRUE(wish.has_value());
  EXPECT_GT(std::abs(wish->phase_rate_rad_s - 6.0), 1e-3);
  ASSERT_TRUE(crowd.set_role(3, Role::seen));
  for (int i = 0; i < 1000; ++i) crowd.step();
  EXPECT_NEAR(crowd.find(1)->state.phase_rate_rad_s, 6.0, 1e-4);  // 5 rad/s has no pull
  EXPECT_FALSE(crowd.set_role(77, Role::own));
  EXPECT_FALSE(crowd.wish(77).has_value());
}

TEST(Members, RulesChangeWhileItRuns) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group({Rules{}, plain_gait(), {}});
  auto all = some_agents(6);
  for (std::size_t i = 0; i < all.size(); ++i)
    all[i].traits.omega_rad_s = 5.5 + 0.2 * static_cast<double>(i);
  crowd.add(0, all);
  for (int i = 0; i < 5000; ++i) crowd.step();  // phases drift by many turns
  Rules rules;
  rules.phase = {{Topology::ring}, 5.0};
  crowd.set_rules(0, rules);
  crowd.step();
  for (const double rate : crowd.phase_rate_rad_s()) {  // turns that were drifted do not count
    EXPECT_LT(std::abs(rate - 6.0), 5.0 * 4.0 * std::numbers::pi + 1.0);
  }
}

TEST(Members, MistakesAreRefusedBeforeAnythingChanges) {
  Crowd crowd({.dt_s = 0.011});
  Rules rules;
  rules.phase = {{Topology::all_to_all}, 1.0};
  crowd.add_group({rules, plain_gait(), {}});
  const auto refused = [&](const std::function<void(Agent&)>& spoil, const std::string& word) {
    auto bad = some_agents(2);
    spoil(bad[1]);
    const std::string words = mimesis::testing::refusal([&] { crowd.add(0, bad); });
    EXPECT_NE(words.find(word), std::string::npos) << words;
    EXPECT_EQ(crowd.size(), 0);
  };
  refused([](Agent& a) { a.id = 1; }, "agent 1 is there already");
  refused([](Agent& a) { a.id = 0; }, "from 1");
  refused([](Agent& a) { a.state.position_W_m.x() = std::nan(""); }, "agent 2, state");
  refused([](Agent& a) { a.traits.omega_rad_s = -1.0; }, "eigenfrequency");
  refused([](Agent& a) { a.traits.stride = 0.0; }, "stride");
  refused([](Agent& a) { a.traits.radius_m = -0.1; }, "radius");
  refused([](Agent& a) { a.traits.lane_m = INFINITY; }, "lane");
  EXPECT_THROW(crowd.add(0, some_agents(60)), ConfigError);  // k N dt = .66
  crowd.add(0, some_agents(40));
  rules.phase.gain_1_s = 2.0;
  EXPECT_THROW(crowd.set_rules(0, rules), ConfigError);
  rules.phase = {{Topology::weighted, {{-1, 1, 1.0}}}, 1.0};
  EXPECT_THROW(crowd.set_rules(0, rules), ConfigError);
  rules.phase.graph.edges = {{0, 1, -1.0}};
  EXPECT_THROW(crowd.set_rules(0, rules), ConfigError);
  EXPECT_EQ(crowd.group(0).rules.phase.gain_1_s, 1.0);
  AgentState lost;
  lost.heading_rad = NAN;
  EXPECT_FALSE(crowd.set_state(1, lost));
  EXPECT_FALSE(crowd.set_state(99, {}));
  const Pillar pillar{{0.0, 0.0}, 1e9};
  EXPECT_THROW(crowd.set_obstacles(std::span(&pillar, 1), {}), ConfigError);
}

TEST(Members, NobodyAndOneAreCrowdsToo) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group({all_rules(Topology::ring), plain_gait(), {}});
  crowd.step();
  crowd.add(0, some_agents(1));
  for (int i = 0; i < 10; ++i) crowd.step();
  EXPECT_TRUE(std::isfinite(crowd.x_m()[0]));
  crowd.remove(1);
  crowd.step();
  EXPECT_EQ(crowd.size(), 0);
}

}  // namespace
}  // namespace mimesis::crowd
