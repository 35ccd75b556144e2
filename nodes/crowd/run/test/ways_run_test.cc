// People who go around walls, and through doors: nobody stands for ever.
#include <gtest/gtest.h>

#include <random>
#include <utility>

#include "nodes/crowd/run/scenario_run.h"
#include "nodes/crowd/run/test/small_scenario.h"

namespace mimesis::crowd {
namespace {

Scenario people(const std::vector<double>& from_m, const std::vector<double>& to_m) {
  Scenario s = scenario({group("people", static_cast<int>(from_m.size() / 2))});
  Group& g = s.groups[0];
  g.radius_m = 0.2;
  g.start = {.arrangement = Arrangement::listed, .position_m = from_m};
  g.goals = {.aim = Aim::places, .position_m = to_m, .reached_m = 0.5};
  g.rules = {};
  g.rules.heading = {.kind = HeadingKind::goal, .gain = 1.0, .avoid = true};
  return s;
}

/// Walks until all are at their goals, nobody in another's disc or a polygon; 0: they never are.
double arrival_s(const Scenario& s, double most_s) {
  ScenarioRun run(s);
  while (run.time_s() < most_s) {
    run.step();
    const Crowd& crowd = run.crowd();
    EXPECT_EQ(crowd.contacts().overlapping, 0);
    bool all = true;
    for (int i = 0; i < crowd.size(); ++i) {
      const Agent a = crowd.agent(i);
      for (const Polygon& p : s.polygons) EXPECT_FALSE(inside(p, a.state.position_W_m));
      all = all && (a.state.position_W_m - run.goal_W_m(a.id)).norm() < s.groups[0].goals.reached_m;
    }
    if (all) return run.time_s();
  }
  return 0.0;
}

TEST(WaysRun, OutOfATrapAndAroundAHouse) {
  Scenario s = people({0, 0, 0, 1}, {12, 0, 12, 1});
  s.walls = {{{2, -3}, {2, 3}}, {{2, 3}, {-3, 3}}, {{2, -3}, {-3, -3}}};  // open behind them
  s.polygons = {{{5, -4, 9, -4, 9, 4, 5, 4}}};
  const double took_s = arrival_s(s, 90.0);
  EXPECT_GT(took_s, 15.0);  // 1.3 m/s
  s.walls.push_back({{-3, -3}, {-3, 3}});
  ASSERT_FALSE(faults(s).empty());
  EXPECT_EQ(faults(s)[0].path, "groups.0.goals");
  EXPECT_NE(faults(s)[0].what.find("there is no way for agent 0"), std::string::npos);
}

TEST(WaysRun, AllGoThroughADoor) {
  for (const double wide_m : {0.9, 1.5}) {
    std::mt19937 random(4);
    std::uniform_real_distribution<double> off(-0.1, 0.1);
    std::vector<double> from, to;
    for (int i = 0; i < 40; ++i) {
      const double x = 2.0 + 0.8 * (i / 8), y = (i % 8 - 3.5) * 0.8;
      from.insert(from.end(), {-x + off(random), y + off(random)});
      to.insert(to.end(), {12.0 - x, y});
    }
    Scenario s = people(from, to);
    s.walls = {{{0.0, 0.5 * wide_m}, {0.0, 30.0}}, {{0.0, -0.5 * wide_m}, {0.0, -30.0}}};
    EXPECT_GT(arrival_s(s, 240.0), 10.0) << wide_m;
  }
}

TEST(WaysRun, NobodyStandsInAPolygonNorWantsTo) {
  Scenario s = people({0, 0}, {7, 0});
  s.polygons = {{{5, -4, 9, -4, 9, 4, 5, 4}}};
  EXPECT_EQ(faults(s)[0].what, "the goal of agent 0 at 7, 0 is inside of polygon 0");
  s.polygons[0].corner_m = {-1, -1, 1, -1, 1, 1};
  EXPECT_EQ(faults(s)[0].path, "groups.0.start");
  s.polygons[0].corner_m = {5, 0, 6, 1, 5, 1, 6, 0};
  EXPECT_EQ(faults(s)[0].what, "sides 0 and 2 cross");
  s.walls.assign(501, {{20, 0}, {21, 0}});
  s.polygons[0].corner_m = {5, 0, 6, 0, 6, 1};
  s.groups[0].goals.position_m = {9, 0};
  EXPECT_EQ(faults(s).at(0).path, "walls");
  const Rules goals = std::exchange(s.groups[0].rules, {});
  EXPECT_TRUE(faults(s).empty()) << "nobody plans ways";
  s.schedule = {{.at_s = 5.0, .group = "people", .gait = "", .rules = goals}};
  EXPECT_EQ(faults(s).at(0).path, "walls") << "later";
  s.schedule.clear();
  s.groups[0].rules = goals;
  s.polygons[0].corner_m = {5, 0, 6, 1};
  EXPECT_EQ(faults(s)[0].path, "polygons.0.corner_m");
}

}  // namespace
}  // namespace mimesis::crowd
