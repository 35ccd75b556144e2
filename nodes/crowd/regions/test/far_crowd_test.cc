#include "nodes/crowd/regions/far_crowd.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <optional>

#include "nodes/crowd/run/test/small_scenario.h"

namespace mimesis::crowd {
namespace {

using namespace testing;
using namespace std::chrono_literals;

bool nobody(const Eigen::Vector2d&) { return false; }
bool right(const Eigen::Vector2d& p) { return p.y() < 0.0; }

FarAgent walker(AgentId id, double x_m, double y_m) {
  FarAgent agent{.id = id, .group = 0};
  agent.state.position_W_m = {x_m, y_m};
  agent.state.velocity_W_m_s = {1.2, 0.5};
  agent.state.phase_rad = 1.0;
  agent.state.phase_rate_rad_s = 6.0;
  return agent;
}

FarSums sums_of(int agents, double phase_rad) {
  FarSums far{.group = 0};
  far.sums.count = agents;
  far.sums.cos_phase = agents * std::cos(phase_rad);
  far.sums.sin_phase = agents * std::sin(phase_rad);
  far.sums.error_m = 3.0;
  far.sums.leader = 1;
  far.sums.leader_phase_rad = phase_rad;
  far.phase_rate_rad_s = 5.7 * agents;
  far.speed_m_s = 1.2 * agents;
  return far;
}

TEST(FarCrowd, BringsOthersToThePresent) {
  ScenarioRun run(scenario({squad("a", 4, Topology::chain)}), nobody);
  FarCrowd far({.coordinators = 2, .own = 0}, run);
  far.hear(1, {.stamp = 10s, .agents = {walker(2, 3.0, 4.0)}, .sums = {sums_of(4, 0.3)}});
  far.import(run, 10s + 100ms);
  ASSERT_EQ(far.agents().size(), 1u);
  EXPECT_NEAR(far.agents()[0].state.position_W_m.x(), 3.12, 1e-12);
  EXPECT_NEAR(far.agents()[0].state.position_W_m.y(), 4.05, 1e-12);
  EXPECT_NEAR(far.agents()[0].state.phase_rad, 1.6, 1e-12);
  const auto mirror = run.crowd().find(2);
  ASSERT_TRUE(mirror.has_value());
  EXPECT_EQ(mirror->role, Role::mirror);
  EXPECT_NEAR(mirror->state.position_W_m.x(), 3.12, 1e-12);
}

TEST(FarCrowd, AGroupThatCannotTakeMoreGoesOnWithoutThem) {
  Group a = squad("a", 4, Topology::star);
  a.rules.phase.gain_1_s = 6.0;  // fast enough for steps of 0.02 s with 4, not with 6
  ScenarioRun run(scenario({a, squad("b", 2, Topology::chain)}), nobody);
  FarCrowd far({.coordinators = 2, .own = 0}, run);
  FarReport report{.stamp = 10s};
  for (AgentId id = 1; id <= 6; ++id)
    report.agents.push_back(walker(id, 3.0 * static_cast<double>(id), 4.0));
  far.hear(1, report);
  for (int k = 0; k < 3; ++k) {
    const std::string why = far.import(run, 10s + k * 20ms);
    EXPECT_NE(why.find("rules I and III"), std::string::npos) << why;
    EXPECT_FALSE(run.crowd().find(5).has_value());
    run.step();
  }
}

TEST(FarCrowd, SumsOfOthersTurnAtTheirMeanRate) {
  Scenario s = scenario({squad("a", 4, Topology::all_to_all)});
  s.groups[0].rules.length = {};
  ScenarioRun run(s, right);
  FarCrowd far({.coordinators = 2, .own = 0}, run);
  // Heard 0.1 s late: 0.3 rad have become 0.87 rad, where ours go, as they are few.
  for (int k = 0; k < 400; ++k) {
    FarSums sums = sums_of(8, 0.3 + 5.7 * 0.02 * k);
    far.hear(1, {.stamp = 10s + k * 20ms, .agents = {}, .sums = {sums}});
    far.import(run, 10s + 100ms + k * 20ms);
    run.step();
  }
  for (const double phase : run.crowd().phase_rad()) {
    EXPECT_NEAR(std::remainder(phase - (0.87 + 5.7 * 0.02 * 400), 2.0 * M_PI), 0.0, 0.03);
  }
}

TEST(FarCrowd, TakesOnlyWhoIsNearIfSumsAreEnough) {
  Scenario s = scenario({squad("a", 4, Topology::all_to_all)});
  ScenarioRun run(s, right);
  ASSERT_EQ(run.crowd().size(), 2);
  const Eigen::Vector2d ours(run.crowd().x_m()[0], run.crowd().y_m()[0]);
  AgentId absent = 1;
  while (run.crowd().find(absent)) ++absent;
  FarCrowd far({.coordinators = 2, .own = 0, .sight_m = 5.0}, run);
  far.hear(1, {.stamp = 10s, .agents = {walker(absent, ours.x(), ours.y() + 2.0)}, .sums = {}});
  far.import(run, 10s);
  EXPECT_EQ(far.taken_into_account(), 1);
  EXPECT_EQ(run.crowd().find(absent)->role, Role::ghost);
  far.hear(1, {.stamp = 11s, .agents = {walker(absent, ours.x(), ours.y() + 50.0)}, .sums = {}});
  far.import(run, 11s);
  EXPECT_EQ(far.taken_into_account(), 0);
  EXPECT_FALSE(run.crowd().find(absent).has_value());
  EXPECT_EQ(far.agents().size(), 1u) << "seen by who watches the whole";
}

TEST(FarCrowd, WhoeverIsNotTrustedIsCoupledToNobody) {
  ScenarioRun run(scenario({squad("a", 4, Topology::chain)}), nobody);
  FarCrowd far({.coordinators = 2, .own = 0}, run);
  FarAgent robot = walker(2, 1.0, 1.0);
  robot.external = true;
  far.hear(1, {.stamp = 10s, .agents = {robot}, .sums = {}});
  far.import(run, 10s);
  EXPECT_TRUE(is_coupled(run.crowd().find(2)->role));
  robot.trusted = false;
  far.hear(1, {.stamp = 10s + 20ms, .agents = {robot}, .sums = {}});
  far.import(run, 10s + 20ms);
  EXPECT_EQ(run.crowd().find(2)->role, Role::seen);
}

TEST(FarCrowd, WhoNobodySpeaksOfStandsWhereItWas) {
  ScenarioRun run(scenario({squad("a", 4, Topology::chain)}), nobody);
  FarCrowd far({.coordinators = 2, .own = 0, .stale_s = 0.5}, run);
  far.hear(1, {.stamp = 10s, .agents = {walker(2, 1.0, 1.0)}, .sums = {}});
  far.import(run, 10s + 400ms);
  EXPECT_TRUE(far.heard(1, 10s + 400ms));
  EXPECT_EQ(run.crowd().find(2)->role, Role::mirror);
  for (const auto later : {600ms, 5000ms}) {
    far.import(run, 10s + later);
    EXPECT_FALSE(far.heard(1, 10s + later));
    ASSERT_EQ(far.agents().size(), 1u);
    EXPECT_NEAR(far.agents()[0].state.position_W_m.x(), 1.48, 1e-12);
    EXPECT_EQ(far.agents()[0].state.velocity_W_m_s.norm(), 0.0);
    EXPECT_FALSE(far.agents()[0].trusted) << "an obstacle, coupled to nobody";
  }
}

/// Two coordinators in step, with one agent between them.
struct Pair {
  Pair() {
    for (int k = 0; k < 4; ++k) step();
  }
  void step() {
    now += 20ms;
    for (std::size_t c = 0; c < 2; ++c) {
      fars[c].begin_step(runs[c], now);
      if (heard[c]) fars[c].hear(1 - static_cast<int>(c), *heard[c]);
      decided[c] = fars[c].decide(runs[c], now);
      fars[c].import(runs[c], now);
    }
    for (std::size_t c = 0; c < 2; ++c) {
      FarReport report{.stamp = now, .agents = {}, .sums = {}, .ownership = fars[c].report()};
      for (const Claim& claim : report.ownership.owned) {
        report.agents.push_back({.id = claim.id,
                                 .group = 0,
                                 .state = runs[c].crowd().find(claim.id)->state,
                                 .epoch = claim.epoch});
      }
      heard[1 - c] = report;
    }
  }

  Scenario squads = scenario({squad("a", 4, Topology::chain)});
  std::array<ScenarioRun, 2> runs{ScenarioRun(squads), ScenarioRun(squads, nobody)};
  std::array<FarCrowd, 2> fars{FarCrowd({.coordinators = 2, .own = 0}, runs[0]),
                               FarCrowd({.coordinators = 2, .own = 1}, runs[1])};
  std::array<std::optional<FarReport>, 2> heard{};
  std::array<FarCrowd::Decided, 2> decided{};
  Time now = 10s;
};

TEST(FarCrowd, WhoIsOnTheWayIsSomewhereAndOnlyOnce) {
  Pair two;
  auto& [giver, taker] = two.fars;
  EXPECT_EQ(taker.agents().size(), 4u);
  const auto passing = giver.give(two.runs[0], 3, 1, two.now);
  ASSERT_TRUE(passing.has_value());
  EXPECT_FALSE(giver.give(two.runs[0], 3, 1, two.now).has_value()) << "it is not ours any more";
  giver.import(two.runs[0], two.now);
  ASSERT_EQ(giver.agents().size(), 1u);
  EXPECT_EQ(giver.agents()[0].id, 3u);
  EXPECT_EQ(two.runs[0].crowd().find(3)->role, Role::mirror);
  EXPECT_TRUE(taker.hear(two.runs[1], *passing, two.now));
  EXPECT_FALSE(taker.hear(two.runs[1], *passing, two.now)) << "once";
  EXPECT_EQ(two.runs[1].crowd().find(3)->role, Role::own);
  two.step();
  two.step();
  EXPECT_EQ(giver.agents().size(), 1u);
  EXPECT_EQ(taker.agents().size(), 3u);
  EXPECT_TRUE(giver.repeats(two.now + 10s).empty()) << "it has arrived";
}

TEST(FarCrowd, AnOfferThatIsLostIsRepeatedAndOneThatIsNotTakenComesBack) {
  Pair two;
  FarCrowd& giver = two.fars[0];
  ASSERT_TRUE(giver.give(two.runs[0], 3, 1, two.now).has_value());
  const AgentState before = two.runs[0].crowd().find(3)->state;
  int repeated = 0;
  for (int k = 0; k < 30 && two.runs[0].crowd().find(3)->role != Role::own; ++k) {
    two.step();
    for (const Passing& passing : giver.repeats(two.now)) {
      ++repeated;
      EXPECT_EQ(passing.stamp, 10s + 80ms) << "it stands";
    }
  }
  EXPECT_EQ(repeated, 5);
  EXPECT_EQ(two.decided[0].taken, 1);
  EXPECT_EQ(two.runs[0].crowd().find(3)->role, Role::own);
  EXPECT_EQ(two.runs[0].crowd().find(3)->state.position_W_m, before.position_W_m);
}

}  // namespace
}  // namespace mimesis::crowd
