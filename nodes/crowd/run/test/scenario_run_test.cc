#include "nodes/crowd/run/scenario_run.h"

#include <gtest/gtest.h>

#include <cmath>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/testing/refusal.h"
#include "nodes/crowd/run/test/small_scenario.h"

namespace mimesis::crowd {
namespace {

using namespace testing;

Agent agent_of(const ScenarioRun& run, AgentId id) {
  const auto agent = run.crowd().find(id);
  EXPECT_TRUE(agent.has_value()) << id;
  return agent.value_or(Agent{});
}

void steps(ScenarioRun& run, double s) {
  const double end = run.time_s() + s;
  while (run.time_s() < end - 1e-9) run.step();
}

TEST(Roster, NamesEverybodyGroupByGroupThenTheExternalOnes) {
  Scenario s = scenario({group("a", 3), group("b", 2)});
  s.externals = {{.name = "robot", .group = "b", .place_m = 1.5, .radius_m = 0.4}};
  const Roster roster(s);
  EXPECT_EQ(roster.agents(), 5);
  EXPECT_EQ(roster.externals(), 1);
  EXPECT_EQ(roster.home(3), 0);
  EXPECT_EQ(roster.home(4), 1);
  EXPECT_EQ(roster.external_id(0), 6u);
  EXPECT_EQ(roster.external(6), 0);
  EXPECT_EQ(roster.external(5), -1);
  EXPECT_EQ(roster.home(6), 1);
  EXPECT_EQ(roster.start(6).traits.place_m, 1.5);
  EXPECT_EQ(roster.start(6).role, Role::external);
  EXPECT_FALSE(roster.known(0));
  EXPECT_FALSE(roster.known(7));
}

TEST(ScenarioRun, RefusesAScenarioThatHasFaults) {
  Scenario s = scenario({group("a", 3)});
  s.groups[0].gait = "drunk";
  const std::string refused = mimesis::testing::refusal([&] { const ScenarioRun run(s); });
  EXPECT_NE(refused.find("groups.0.gait"), std::string::npos) << refused;
}

TEST(ScenarioRun, TheScheduleChangesRulesAndGaitsAtItsTime) {
  Scenario s = scenario({group("a", 3)});
  s.groups[0].spread_rad_s = 0.5;
  Change change{.at_s = 1.0, .group = "a", .gait = "happy", .rules = s.groups[0].rules};
  change.rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 0.7};
  s.schedule = {change};
  ScenarioRun run(s);
  const double before = agent_of(run, 2).traits.omega_rad_s;
  while (run.time_s() < 0.99) run.step();
  EXPECT_EQ(run.crowd().group(0).rules.phase.gain_1_s, 0.0);
  EXPECT_TRUE(run.changed_groups().empty());
  run.step();
  EXPECT_EQ(run.crowd().group(0).rules.phase.gain_1_s, 0.7);
  ASSERT_EQ(run.changed_groups().size(), 1u);
  EXPECT_EQ(run.gait(0), 1);
  EXPECT_NEAR(agent_of(run, 2).traits.omega_rad_s, before + 6.6 - 5.7, 1e-12)
      << "who is faster than others stays so";
}

TEST(ScenarioRun, AChangeThatIsRefusedIsNotForgotten) {
  Scenario s = scenario({group("a", 3)});
  Change change{.at_s = 0.1, .group = "a", .gait = "happy", .rules = s.groups[0].rules};
  change.rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 20.0};  // k N dt = 1.2
  s.schedule = {change};
  ScenarioRun run(s);
  steps(run, 0.1);
  for (int again = 0; again < 3; ++again) {
    const double before_s = run.time_s();
    EXPECT_THROW(run.step(), ConfigError);
    EXPECT_GT(run.time_s(), before_s) << "the others stand still";
    EXPECT_TRUE(run.changed_groups().empty());
    EXPECT_EQ(run.gait(0), 0);
  }
}

TEST(ScenarioRun, AgentsFollowTheBeat) {
  Scenario s = scenario({group("a", 5)});
  s.beat = {.phase_rad = 0.4, .rate_rad_s = 5.7};
  s.groups[0].beat_gain_1_s = 1.0;
  ScenarioRun run(s);
  steps(run, 15.0);
  EXPECT_NEAR(run.beat_rad(), 0.4 + 5.7 * 15.0, 1e-6);
  for (const double phase : run.crowd().phase_rad()) {
    EXPECT_NEAR(math::wrap_pi(phase - run.beat_rad()), 0.0, 1e-3);
  }
}

TEST(ScenarioRun, WhoIsInAZoneGoesOver) {
  Scenario s = scenario({group("walk", 4), group("hurry", 0)});
  s.groups[1].gait = "happy";
  s.zones = {{.name = "line",
              .from = "walk",
              .to = "hurry",
              .least_x_m = 2.0,
              .least_y_m = -9.0,
              .most_x_m = 4.0,
              .most_y_m = 9.0}};
  ScenarioRun run(s);
  std::vector<ScenarioRun::Switch> seen;
  while (run.time_s() < 8.0) {
    run.step();
    seen.insert(seen.end(), run.switches().begin(), run.switches().end());
  }
  ASSERT_EQ(seen.size(), 4u);
  EXPECT_EQ(run.crowd().rows(1).count, 4);
  EXPECT_NEAR(agent_of(run, 1).traits.omega_rad_s, 6.6, 1e-12);
}

TEST(ScenarioRun, WhoMustGatherMarksTimeUntilAllHaveCome) {
  Scenario s = scenario({group("come", 2), group("pair", 0)});
  s.groups[0].start = {.arrangement = Arrangement::listed, .position_m = {0.0, 0.0, -4.0, 1.0}};
  s.groups[0].start.phase = PhaseStart::equal;
  s.zones = {{.name = "gate",
              .from = "come",
              .to = "pair",
              .least_x_m = 1.0,
              .least_y_m = -5.0,
              .most_x_m = 2.0,
              .most_y_m = 5.0,
              .gather = 2}};
  ScenarioRun run(s);
  double waited_from = -1.0, x = 0.0, phase = 0.0, last_phase = 0.0;
  while (run.switches().empty()) {
    last_phase = agent_of(run, 1).state.phase_rad;
    run.step();
    ASSERT_LT(run.time_s(), 20.0);
    if (waited_from < 0.0 && run.waiting(1)) {
      waited_from = run.time_s();
      x = agent_of(run, 1).state.position_W_m.x();
      phase = agent_of(run, 1).state.phase_rad;
    }
  }
  EXPECT_NEAR(run.time_s() - waited_from, 4.0 / (5.7 * 0.2), 0.3) << "the way of the other";
  const Agent first = agent_of(run, 1);
  EXPECT_NEAR(first.state.position_W_m.x(), x, 0.03) << "on the spot";
  EXPECT_GT(last_phase, phase + 5.7 * 3.0) << "in the rhythm";
  EXPECT_EQ(run.crowd().group_of(1), 1);
  EXPECT_EQ(run.crowd().group_of(2), 1);
  EXPECT_FALSE(run.waiting(1));
  steps(run, 1.0);
  EXPECT_NEAR(agent_of(run, 1).state.position_W_m.x() - x, 5.7 * 0.2, 0.1) << "full steps again";
}

TEST(ScenarioRun, EmotionsSwitchWhenGroupsMeet) {
  Scenario s = scenario({group("right", 2), group("left", 2), group("glad", 0)});
  s.groups[0].start.arrangement = s.groups[1].start.arrangement = Arrangement::row;
  s.groups[0].origin_x_m = -5.0;
  s.groups[1].origin_x_m = 5.0;
  s.groups[0].origin_y_m = 3.0;
  s.groups[1].origin_y_m = 3.5;
  s.groups[1].heading_rad = M_PI;
  s.groups[2].gait = "happy";
  s.encounters = {{.group = "right", .other = "left", .to = "glad", .within_m = 2.0}};
  ScenarioRun run(s);
  while (run.switches().empty() && run.time_s() < 20.0) run.step();
  ASSERT_FALSE(run.switches().empty());
  double least = 1e9;
  const AgentId id = run.switches()[0].id;
  for (const AgentId other : {3, 4}) {
    least = std::min(
        least,
        (agent_of(run, id).state.position_W_m - agent_of(run, other).state.position_W_m).norm());
  }
  EXPECT_NEAR(least, 2.0, 0.1);
  steps(run, 3.0);
  EXPECT_EQ(run.crowd().rows(2).count, 2);
  EXPECT_EQ(run.crowd().rows(1).count, 2) << "the others have no reason";
}

TEST(ScenarioRun, AWishedGaitMovesAgentsToAGroupThatWalksSo) {
  Scenario s = scenario({group("a", 3), group("b", 1)});
  s.groups[1].gait = "happy";
  ScenarioRun run(s);
  const AgentId wished[] = {2};
  EXPECT_EQ(run.wish_gait(wished, "happy"), "");
  EXPECT_EQ(run.crowd().group_of(2), 1);
  EXPECT_EQ(run.crowd().group_of(1), 0);
  EXPECT_EQ(run.wish_gait({}, "happy"), "");
  EXPECT_EQ(run.gait(0), 1);
  EXPECT_EQ(run.wish_gait({}, "sad"), "'sad' is none of the scenario's gaits: neutral, happy");
  const AgentId nobody[] = {99};
  EXPECT_EQ(run.wish_gait(nobody, "happy"), "there is no agent 99");
}

TEST(ScenarioRun, RunsAreEqual) {
  const Scenario s = scenario({squad("a", 16, Topology::all_to_all)});
  ScenarioRun a(s), b(s);
  steps(a, 5.0);
  steps(b, 5.0);
  for (AgentId id = 1; id <= 16; ++id) {
    EXPECT_EQ(agent_of(a, id).state.position_W_m, agent_of(b, id).state.position_W_m);
  }
}

}  // namespace
}  // namespace mimesis::crowd
