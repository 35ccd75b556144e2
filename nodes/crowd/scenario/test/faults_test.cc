#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {
namespace {

/// A group of four, one that others come to, a beat and an agent from outside.
Scenario sound() {
  Scenario s;
  s.beat.rate_rad_s = 5.0;
  s.gaits = {{.name = "walk"}, {.name = "run"}};
  Group four;
  four.name = "four";
  four.count = 4;
  four.gait = "walk";
  four.formation.shape = Shape::line;
  four.rules.length = {.graph = {Topology::ring}, .gain_1_m = 0.1};
  four.goals = {.aim = Aim::places, .position_m = {1, 2}};
  Group guests;
  guests.name = "guests";
  guests.gait = "run";
  guests.rules.phase = {.graph = {Topology::wheel}, .gain_1_s = 1.0};  // once there are four
  guests.rules.heading = {.kind = HeadingKind::goal};                  // goals come with agents
  guests.beat_gain_1_s = 0.5;
  s.groups = {four, guests};
  s.schedule = {{.at_s = 1.0, .group = "four", .gait = "run", .rules = four.rules},
                {.at_s = 2.0, .group = "four", .gait = "", .rules = four.rules}};
  s.zones = {{.name = "door", .from = "four", .to = "guests", .most_x_m = 1, .most_y_m = 1}};
  s.encounters = {{.group = "four", .other = "four", .to = "guests"}};
  s.externals = {{.name = "robot", .group = "guests"}};
  s.pillars = {{.radius_m = 0.3}};
  s.walls = {{.to_W_m = {1.0, 0.0}}};
  return s;
}

TEST(Faults, NoneInASoundScenario) {
  for (const Fault& fault : faults(sound())) ADD_FAILURE() << fault.path << ": " << fault.what;
}

TEST(Faults, AreFoundAndNamed) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  struct Case {
    const char* path;
    const char* what;
    std::function<void(Scenario&)> spoil;
  };
  const Case cases[] = {
      {"gaits.1.name", "there twice", [](Scenario& s) { s.gaits[1].name = "walk"; }},
      {"gaits.0.eigenfrequency_rad_s", "must advance",
       [](Scenario& s) { s.gaits[0].eigenfrequency_rad_s = 0.0; }},
      {"gaits.0.mean_m_rad", "g > 0", [&](Scenario& s) { s.gaits[0].mean_m_rad = nan; }},
      {"groups.1.name", "there twice", [](Scenario& s) { s.groups[1].name = "four"; }},
      {"groups.0.gait", "there are: walk, run", [](Scenario& s) { s.groups[0].gait = "fly"; }},
      {"groups.1.count", "N = 0",
       [](Scenario& s) { s.zones.clear(), s.encounters.clear(), s.externals.clear(); }},
      {"groups.0.count", "N = -3", [](Scenario& s) { s.groups[0].count = -3; }},
      {"groups.0.spread_rad_s", "would not walk",
       [](Scenario& s) { s.groups[0].spread_rad_s = 6.0; }},
      {"groups.1.beat_gain_1_s", "would repel",
       [](Scenario& s) { s.groups[1].beat_gain_1_s = -1.0; }},
      {"groups.1.beat_gain_1_s", "no beat", [](Scenario& s) { s.beat.rate_rad_s = 0.0; }},
      {"groups.1.beat_gain_1_s", "a leader already",
       [](Scenario& s) { s.groups[1].rules.phase.leader_gain_1_s = 1.0; }},
      {"groups.0.start.position_m", "expected 8 numbers",
       [](Scenario& s) { s.groups[0].start.arrangement = Arrangement::listed; }},
      {"groups.0.start.phase_rad", "expected 4 phases",
       [](Scenario& s) { s.groups[0].start.phase = PhaseStart::listed; }},
      {"groups.0.start", "no room",
       [](Scenario& s) {
         s.groups[0].start = {.arrangement = Arrangement::box, .length_m = 0.5, .width_m = 0.5};
       }},
      {"groups.0.formation.place_m", "expected 4 places",
       [](Scenario& s) { s.groups[0].formation.shape = Shape::listed; }},
      {"groups.0.formation.distances.0", "two of the agents 0 to 3",
       [](Scenario& s) {
         s.groups[0].formation = {.shape = Shape::distances, .distances = {{0, 4, 1.0}}};
       }},
      {"groups.0.goals.position_m", "x, y of every goal",
       [](Scenario& s) {
         s.groups[0].goals.position_m = {1, 2, 3};
       }},
      {"groups.0.goals.position_m", "expected 8 numbers",
       [](Scenario& s) {
         s.groups[0].goals.position_m = {1, 2, 3, 4};
       }},
      {"groups.0.rules.length.gain_1_m", "not a number",
       [&](Scenario& s) { s.groups[0].rules.length.gain_1_m = nan; }},
      {"groups.0.rules.phase.graph", "a wheel has at least 4",
       [](Scenario& s) {
         s.groups[0].rules.phase = {.graph = {Topology::wheel}, .gain_1_s = 1.0};
         s.groups[0].count = 3;
       }},
      {"groups.0.rules.phase.directed", "list its edges",
       [](Scenario& s) {
         s.groups[0].rules.phase = {.graph = {.topology = Topology::ring, .directed = true},
                                    .gain_1_s = 1.0};
       }},
      {"groups.0.rules.phase.edges", "not connected",
       [](Scenario& s) {
         s.groups[0].rules.phase = {.graph = {Topology::weighted, {{3, 0}, {3, 1}, {3, 2}}, true},
                                    .gain_1_s = 1.0};
       }},
      {"groups.0.rules.phase.leader_gain_1_s", "without followers",
       [](Scenario& s) {
         s.groups[0].count = 1;
         s.groups[0].rules = {.phase = {.leader_gain_1_s = 1.0}};
       }},
      {"groups.0.rules.heading.gain", "contraction needs the gain > 0",
       [](Scenario& s) { s.groups[0].rules.heading = {.kind = HeadingKind::keep, .gain = -1.0}; }},
      {"groups.0.rules.heading.gain", "nothing turns",
       [](Scenario& s) { s.groups[0].rules.heading = {.kind = HeadingKind::goal, .gain = 0.0}; }},
      {"groups.0.rules.heading.ahead_m", "must be > 0",
       [](Scenario& s) {
         s.groups[0].rules.heading = {.kind = HeadingKind::lane, .ahead_m = 0.0};
       }},
      {"groups.0.rules.heading.kind", "has no goals",
       [](Scenario& s) {
         s.groups[0].goals = {};
         s.groups[0].rules.heading = {.kind = HeadingKind::goal};
       }},
      {"groups.1.rules.phase.edges", "edges fix N",
       [](Scenario& s) {
         s.groups[1].rules.phase.graph = {Topology::weighted, {{0, 1}}};
       }},
      {"schedule.1.at_s", "before the change above", [](Scenario& s) { s.schedule[1].at_s = 0.5; }},
      {"schedule.0.gait", "no gait 'fly'", [](Scenario& s) { s.schedule[0].gait = "fly"; }},
      {"schedule.0.rules.length.gain_1_m", "contraction needs m_z > 0",
       [](Scenario& s) { s.schedule[0].rules.length.gain_1_m = -1.0; }},
      {"zones.0.to", "no group", [](Scenario& s) { s.zones[0].to = "nobody"; }},
      {"zones.0.most_x_m", "not above", [](Scenario& s) { s.zones[0].most_x_m = 0.0; }},
      {"zones.0.gather", "never come together", [](Scenario& s) { s.zones[0].gather = 0; }},
      {"encounters.0.to", "they are in", [](Scenario& s) { s.encounters[0].to = "four"; }},
      {"encounters.0.within_m", "so near", [](Scenario& s) { s.encounters[0].within_m = 0.0; }},
      {"externals.0.group", "no group", [](Scenario& s) { s.externals[0].group = "nobody"; }},
      {"externals.1.name", "there twice",
       [](Scenario& s) { s.externals.push_back(s.externals[0]); }},
      {"pillars.0.radius_m", "not above 0", [](Scenario& s) { s.pillars[0].radius_m = 0.0; }},
      {"walls.0", "ends where it begins", [](Scenario& s) { s.walls[0].to_W_m.setZero(); }},
      {"groups", "N = 0", [](Scenario& s) { s = Scenario(); }},
  };
  for (const Case& c : cases) {
    Scenario s = sound();
    c.spoil(s);
    bool found = false;
    std::string all;
    for (const Fault& fault : faults(s)) {
      found = found || (fault.path == c.path && fault.what.find(c.what) != std::string::npos);
      all += "\n" + fault.path + ": " + fault.what;
    }
    EXPECT_TRUE(found) << "expected " << c.path << ": ..." << c.what << "..., found" << all;
  }
}

TEST(Scenario, GroupGrowsByZonesEncountersAndTheBus) {
  Scenario s = sound();
  EXPECT_TRUE(s.grows("guests"));
  EXPECT_FALSE(s.grows("four"));
  s.zones.clear();
  s.encounters.clear();
  EXPECT_TRUE(s.grows("guests"));
  s.externals.clear();
  EXPECT_FALSE(s.grows("guests"));
}

}  // namespace
}  // namespace mimesis::crowd
