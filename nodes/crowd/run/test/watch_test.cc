#include "nodes/crowd/run/watch.h"

#include <gtest/gtest.h>

#include <cmath>

#include "nodes/crowd/run/test/small_scenario.h"

namespace mimesis::crowd {
namespace {

using namespace testing;

std::vector<Observed> everybody(const ScenarioRun& run) {
  std::vector<Observed> all;
  const Crowd& crowd = run.crowd();
  for (int row = 0; row < crowd.size(); ++row) {
    const Agent a = crowd.agent(row);
    all.push_back({.id = a.id,
                   .group = *crowd.group_of(a.id),
                   .coupled = is_coupled(a.role),
                   .p_W_m = a.state.position_W_m,
                   .heading_rad = a.state.heading_rad,
                   .phase_rad = a.state.phase_rad,
                   .place_m = a.traits.place_m,
                   .lane_m = a.traits.lane_m});
  }
  return all;
}

void walk(ScenarioRun& run, Watch& watch, double until_s) {
  while (run.time_s() < until_s - 1e-9) {
    watch.observe(run, run.time_s(), everybody(run));
    run.step();
  }
  watch.observe(run, run.time_s(), everybody(run));
}

const RuleLine* line(const std::vector<RuleLine>& lines, Rule rule) {
  for (const RuleLine& l : lines) {
    if (l.rule == rule) return &l;
  }
  return nullptr;
}

/// A body that sways by some millimetres keeps its distances no better than that.
TEST(Watch, RatesOfBodiesAreMeasuredUntilTheirGroupIsFormed) {
  Scenario s = scenario({squad("a", 6, Topology::all_to_all)});
  s.groups[0].start.phase = PhaseStart::equal;
  s.groups[0].rules.heading.kind = HeadingKind::keep;
  ScenarioRun run(s);
  Watch with(run), without(run);
  const auto observe = [&] {
    std::vector<Observed> all = everybody(run);
    all[2].p_W_m.x() += 0.003 * std::sin(run.crowd().phase_rad()[2]);
    without.observe(run, run.time_s(), all);
    all[2].external = true;
    with.observe(run, run.time_s(), all);
  };
  for (; run.time_s() < 60.0; run.step()) observe();
  const auto measured = [](const Watch& watch) {
    return *line(watch.lines(), Rule::length)->report.measured_1_s;
  };
  const double expected = line(with.lines(), Rule::length)->certificate.expected_1_s;
  EXPECT_NEAR(measured(with), expected, 0.1 * expected);
  EXPECT_LT(measured(without), 0.5 * expected) << "of what it does not do any more";
  EXPECT_FALSE(with.broken());
}

TEST(Watch, AGroupWithAgentsFromOutsideIsNotBlamedForItsRate) {
  Scenario s = scenario({squad("a", 6, Topology::all_to_all)});
  s.groups[0].start.phase = PhaseStart::equal;
  s.groups[0].rules.heading.kind = HeadingKind::keep;
  ScenarioRun run(s);
  Watch with(run), without(run);
  for (; run.time_s() < 60.0; run.step()) {
    std::vector<Observed> all = everybody(run);
    all[2].p_W_m.x() += 0.05 * std::sin(run.crowd().phase_rad()[2]);
    without.observe(run, run.time_s(), all);
    all[2].external = true;
    with.observe(run, run.time_s(), all);
  }
  EXPECT_TRUE(without.broken());
  EXPECT_FALSE(with.broken());
  EXPECT_TRUE(line(with.lines(), Rule::length)->report.broken()) << "it is shown all the same";
  EXPECT_EQ(line(with.lines(), Rule::length)->guests, 1);
  EXPECT_NE(
      line(with.lines(), Rule::length)->certificate.why.find("1 of 6 agents come from outside"),
      std::string::npos);
  EXPECT_EQ(line(without.lines(), Rule::length)->certificate.why.find("from outside"),
            std::string::npos);
}

TEST(Watch, TheGuaranteeFallsWithTheAgeOfWhatIsKnownOfGuests) {
  ScenarioRun run(scenario({squad("a", 6, Topology::all_to_all)}));
  Watch watch(run);
  const auto rate = [&] { return line(watch.lines(), Rule::phase)->certificate.guaranteed_1_s; };
  const auto see = [&](double for_s, double age_s) {
    for (const double until_s = run.time_s() + for_s; run.time_s() < until_s; run.step()) {
      std::vector<Observed> all = everybody(run);
      all[2].external = true;
      all[2].age_s = age_s;
      watch.observe(run, run.time_s(), all);
    }
    return watch.take_voided();
  };
  const double free = rate();
  EXPECT_EQ(see(6.0, 0.015), "group a: what is known of agents from outside is up to 0.02 s old");
  const double young = rate();
  EXPECT_LT(young, free);
  EXPECT_GT(young, 0.9 * free);
  EXPECT_EQ(see(6.0, 0.018), "");
  EXPECT_EQ(see(0.1, 0.15), "group a: what is known of agents from outside is up to 0.16 s old");
  EXPECT_LT(rate(), 0.9 * young);
  EXPECT_EQ(see(4.0, 0.03), "") << "not yet";
  EXPECT_EQ(see(8.0, 0.03), "group a: what is known of agents from outside is up to 0.04 s old");
  EXPECT_LT(rate(), young);
}

TEST(Watch, RatesThatHoldInTheEndAreMeasuredThere) {
  ScenarioRun run(scenario({squad("a", 9, Topology::all_to_all)}));
  Watch watch(run);
  walk(run, watch, 60.0);
  for (const Rule rule : {Rule::length, Rule::heading}) {
    const auto lines = watch.lines();
    const RuleLine& l = *line(lines, rule);
    EXPECT_TRUE(l.certificate.in_the_end);
    EXPECT_GE(l.report.measured_1_s.value_or(0.0), 0.99 * l.certificate.guaranteed_1_s);
    EXPECT_LE(l.report.measured_1_s.value_or(0.0), 1.05 * l.certificate.expected_1_s);
  }
}

TEST(Watch, WhoIsBesideItsLaneIsNotOnItThoughItLooksAlong) {
  Scenario s = scenario({squad("a", 6, Topology::all_to_all)});
  s.groups[0].rules.heading = {.kind = HeadingKind::lane, .gain = 0.6, .ahead_m = 2.0};
  ScenarioRun run(s);
  Watch watch(run);
  std::vector<Observed> all = everybody(run);
  for (Observed& a : all) {
    a.heading_rad = 0.0;
    a.p_W_m.y() = a.lane_m;
  }
  watch.observe(run, 0.0, all);
  EXPECT_NEAR(line(watch.lines(), Rule::heading)->disorder, 0.0, 1e-12);
  all[1].p_W_m.y() += 0.5;
  all[1].heading_rad = 0.1;
  watch.observe(run, 0.02, all);
  EXPECT_NEAR(line(watch.lines(), Rule::heading)->disorder, std::hypot(0.1, 0.25), 1e-12);
}

TEST(Watch, MeasuresTheRateThatIsExpected) {
  Scenario s = scenario({group("a", 6)});
  s.groups[0].rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 0.2};
  ScenarioRun run(s);
  Watch watch(run);
  EXPECT_EQ(watch.lines().size(), 1u);
  walk(run, watch, 15.0);
  const auto weakest = watch.weakest();
  ASSERT_TRUE(weakest && weakest->report.measured_1_s);
  EXPECT_EQ(weakest->rule, Rule::phase);
  EXPECT_NEAR(weakest->certificate.expected_1_s, 1.2, 1e-12) << "k N";
  EXPECT_NEAR(*weakest->report.measured_1_s, 1.2, 0.012);
  EXPECT_TRUE(watch.in_order());
  EXPECT_FALSE(watch.broken());
  EXPECT_EQ(watch.number(), 1);
}

TEST(Watch, TellsSinceWhenAFormationStands) {
  ScenarioRun run(scenario({squad("a", 9, Topology::all_to_all)}));
  Watch watch(run);
  walk(run, watch, 60.0);
  ASSERT_TRUE(watch.in_order()) << watch.disorder(run);
  EXPECT_GT(watch.in_order_since_s(), 1.0);
  EXPECT_LT(watch.in_order_since_s(), 50.0);
  EXPECT_LT(watch.place_most_m(), 0.01);
  const auto lines = watch.lines();
  ASSERT_NE(line(lines, Rule::length), nullptr);
  EXPECT_GT(line(lines, Rule::length)->report.measured_1_s.value_or(0.0), 0.0);
}

TEST(Watch, SaysWhatIsNotInOrder) {
  ScenarioRun run(scenario({squad("guards", 9, Topology::all_to_all)}));
  Watch watch(run);
  watch.observe(run, 0.0, everybody(run));
  EXPECT_FALSE(watch.in_order());
  EXPECT_NE(watch.disorder(run).find("guards: phases"), std::string::npos) << watch.disorder(run);
  EXPECT_NE(watch.disorder(run).find("guards: places"), std::string::npos) << watch.disorder(run);
}

TEST(Watch, WhoGoesMakesTheCertificateVoidAndANewOneIsMade) {
  Scenario s = scenario({group("a", 6)});
  s.groups[0].rules.phase = {.graph = {Topology::all_to_all}, .gain_1_s = 0.2};
  ScenarioRun run(s);
  Watch watch(run);
  walk(run, watch, 1.0);
  EXPECT_EQ(watch.take_voided(), "");
  watch.expect_change(0, "'robot' left");
  run.crowd().remove(3);
  watch.observe(run, run.time_s(), everybody(run));
  EXPECT_EQ(watch.number(), 2);
  EXPECT_EQ(watch.take_voided(), "group a: 5 agents instead of 6: 'robot' left");
  EXPECT_EQ(watch.take_voided(), "");
  EXPECT_EQ(watch.agents(0), 5);
  EXPECT_NEAR(watch.weakest()->certificate.expected_1_s, 1.0, 1e-12);
  // An agent that is not trusted is no node of the graph.
  ASSERT_TRUE(run.crowd().set_role(1, Role::seen));
  watch.observe(run, run.time_s(), everybody(run));
  EXPECT_EQ(watch.agents(0), 4);
}

TEST(Watch, RulesThatChangeMakeItVoidToo) {
  Scenario s = scenario({group("a", 6)});
  Change change{.at_s = 0.5, .group = "a", .gait = "", .rules = s.groups[0].rules};
  change.rules.phase = {.graph = {Topology::ring}, .gain_1_s = 0.5};
  s.schedule = {change};
  ScenarioRun run(s);
  Watch watch(run);
  EXPECT_FALSE(watch.weakest().has_value()) << "no rule, no guarantee";
  walk(run, watch, 1.0);
  EXPECT_EQ(watch.take_voided(), "group a: its rules changed");
  ASSERT_TRUE(watch.weakest().has_value());
  EXPECT_NEAR(watch.weakest()->certificate.expected_1_s, 0.5 * 1.0, 1e-9) << "λ⁺ of a ring of 6";
}

TEST(Watch, CountsWhoComesInOnTheWrongFoot) {
  Scenario s = scenario({group("outside", 2), group("corridor", 0), group("yard", 2)});
  s.beat = {.phase_rad = 0.0, .rate_rad_s = 5.7};
  s.groups[0].start.arrangement = Arrangement::row;
  s.groups[0].start.phase = PhaseStart::listed;
  s.groups[0].start.phase_rad = {0.3, 3.0};
  s.groups[1].beat_gain_1_s = 1.0;
  s.groups[2].origin_y_m = 20.0;
  Zone gate{.name = "gate",
            .from = "outside",
            .to = "corridor",
            .least_x_m = 0.5,
            .least_y_m = -9.0,
            .most_x_m = 9.0,
            .most_y_m = 9.0,
            .gather = 2};
  Zone back = gate;  // no agent gathers there
  back.from = "yard", back.gather = 1, back.least_y_m = 10.0, back.most_y_m = 30.0;
  s.zones = {gate, back};
  ScenarioRun run(s);
  Watch watch(run);
  walk(run, watch, 4.0);
  EXPECT_EQ(run.crowd().rows(1).count, 4);
  EXPECT_EQ(watch.entrances().count, 2);
  EXPECT_EQ(watch.entrances().wrong_foot, 1);
  EXPECT_NEAR(watch.entrances().most_rad, 3.0, 0.15);
}

}  // namespace
}  // namespace mimesis::crowd
