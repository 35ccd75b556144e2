// Streams that meet in a corridor, and a crowd in front of a door: nobody stands for ever.
#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <vector>

#include "nodes/crowd/engine/test/walkers.h"

namespace mimesis::crowd {
namespace {

/// Seeds of the slow test; three otherwise.
int seeds() {
  const char* asked = std::getenv("MIMESIS_STREAMS");
  return asked != nullptr ? std::atoi(asked) : 3;
}

Agent person(AgentId id, const Eigen::Vector2d& from, const Eigen::Vector2d& to) {
  Agent a = walker(id, from, to);
  a.traits.radius_m = 0.2;
  return a;
}

/// Walks until everybody is where `through` is true; the time, or 0 if somebody is not there after
/// `most_s`. Nobody may be in another's disc.
template <class Through>
double walk(Crowd& crowd, double most_s, const Through& through) {
  while (crowd.time_s() < most_s) {
    crowd.step();
    EXPECT_EQ(crowd.contacts().overlapping, 0) << crowd.time_s();
    bool all = true;
    for (int i = 0; i < crowd.size(); ++i) all = all && through(crowd.agent(i));
    if (all) return crowd.time_s();
  }
  return 0.0;
}

TEST(Streams, ThatMeetInACorridorPass) {
  for (const double wide_m : {2.0, 4.0, 6.0}) {
    for (int seed = 0; seed < seeds(); ++seed) {
      std::mt19937 random(static_cast<unsigned>(seed));
      std::uniform_real_distribution<double> off(-0.1, 0.1);
      const int side = static_cast<int>(5.0 * wide_m), abreast = static_cast<int>(wide_m / 0.9);
      std::vector<Agent> people;
      for (const double way : {1.0, -1.0}) {
        for (int i = 0; i < side; ++i) {
          const double y = (i % abreast - 0.5 * (abreast - 1)) * 0.9 + off(random);
          const Eigen::Vector2d from(-way * (6.0 + 0.9 * (i / abreast) + off(random)), y);
          people.push_back(person(people.size() + 1, from, {way * 60.0, y}));
        }
      }
      Crowd crowd({.dt_s = 0.02});
      crowd.add_group(walkers());
      crowd.add(0, people);
      const std::vector<Wall> walls{{{-80.0, 0.5 * wide_m}, {80.0, 0.5 * wide_m}},
                                    {{-80.0, -0.5 * wide_m}, {80.0, -0.5 * wide_m}}};
      crowd.set_obstacles({}, walls);
      const double took_s = walk(crowd, 120.0, [](const Agent& a) {
        return a.state.position_W_m.x() * (a.traits.goal_W_m.x() > 0.0 ? 1.0 : -1.0) > 3.0;
      });
      EXPECT_GT(took_s, 0.0) << wide_m << " m, seed " << seed;
      RecordProperty("took_s", std::to_string(took_s));
    }
  }
}

TEST(Streams, GoThroughADoor) {
  for (const double wide_m : {0.8, 1.0, 1.5}) {
    for (int seed = 0; seed < seeds(); ++seed) {
      std::mt19937 random(static_cast<unsigned>(seed));
      std::uniform_real_distribution<double> off(-0.1, 0.1);
      std::vector<Agent> people;
      for (int i = 0; i < 40; ++i) {
        const Eigen::Vector2d from(-2.0 - 0.8 * (i / 8) + off(random),
                                   (i % 8 - 3.5) * 0.8 + off(random));
        people.push_back(person(people.size() + 1, from, {30.0, 0.0}));
      }
      Crowd crowd({.dt_s = 0.02});
      crowd.add_group(walkers());
      crowd.add(0, people);
      const std::vector<Wall> walls{{{0.0, 0.5 * wide_m}, {0.0, 12.0}},
                                    {{0.0, -0.5 * wide_m}, {0.0, -12.0}}};
      crowd.set_obstacles({}, walls);
      const double took_s =
          walk(crowd, 240.0, [](const Agent& a) { return a.state.position_W_m.x() > 1.0; });
      EXPECT_GT(took_s, 0.0) << wide_m << " m, seed " << seed;
    }
  }
}

}  // namespace
}  // namespace mimesis::crowd
