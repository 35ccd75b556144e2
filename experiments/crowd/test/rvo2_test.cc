// The peer does the measured work: it moves the same agents.
#include "experiments/crowd/rvo2.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iostream>
#include <numbers>
#include <random>
#include <vector>

#include "experiments/crowd/crowds.h"

namespace mimesis::crowd {
namespace {

class Rvo2Test : public ::testing::Test {
 protected:
  void SetUp() override {
    if (!Rvo2::built()) GTEST_SKIP() << "no RVO2: cmake --build build --target peers";
  }
};

TEST_F(Rvo2Test, GoesToTheGoalsOfTheCrowd) {
  const Crowd start = circle_crowd(20);
  const auto peer = Rvo2::make(start);
  ASSERT_EQ(peer->size(), 20);
  for (int i = 0; i < 20; ++i) {
    EXPECT_LT((peer->position_W_m(i) - start.agent(i).state.position_W_m).norm(), 1e-5);
  }
  double nearest_m = 1e9;
  while (peer->time_s() < 60.0) {
    peer->step();
    for (int i = 0; i < 20; ++i) {
      for (int j = 0; j < i; ++j) {
        nearest_m = std::min(nearest_m, (peer->position_W_m(i) - peer->position_W_m(j)).norm());
      }
    }
  }
  EXPECT_GT(nearest_m,
            0.55);  // discs of 0.3 m: where all is tight, RVO2 lets them overlap a little
  for (int i = 0; i < 20; ++i) {
    EXPECT_LT((peer->position_W_m(i) - start.agent(i).traits.goal_W_m).norm(), 0.5) << i;
  }
}

TEST_F(Rvo2Test, StreamsGoAlongTheirLanesAsFastAsOursWould) {
  const Crowd start = crossing_crowd(100);
  for (const int threads : {1, 2}) {
    const auto peer = Rvo2::make(start, {.threads = threads});
    while (peer->time_s() < 2.0) peer->step();
    for (int group = 0; group < 2; ++group) {
      const auto [first, count] = start.rows(group);
      Eigen::Vector2d way = Eigen::Vector2d::Zero();
      for (int i = first; i < first + count; ++i) {
        way += (peer->position_W_m(i) - start.agent(i).state.position_W_m) / count;
      }
      const double along = group == 0 ? way.x() : way.y(), across = group == 0 ? way.y() : way.x();
      EXPECT_NEAR(along, 2.0 * 0.22 * 6.0, 0.5) << threads;  // less what avoidance costs
      EXPECT_NEAR(across, 0.0, 0.3) << threads;
    }
  }
}

/// Two streams in a corridor of 4 m: ours take at most twice as long, with discs that never
/// overlap.
TEST_F(Rvo2Test, StreamsInACorridorTakeOursAtMostTwiceAsLong) {
  const std::vector<Wall> walls{{{-80.0, 2.0}, {80.0, 2.0}}, {{-80.0, -2.0}, {80.0, -2.0}}};
  for (const int side : {10, 20}) {
    double ours_s = 0.0, peers_s = 0.0;
    for (unsigned seed = 0; seed < 5; ++seed) {
      std::mt19937 random(seed);
      std::uniform_real_distribution<double> off(-0.1, 0.1);
      std::vector<Agent> people;
      for (const double way : {1.0, -1.0}) {
        for (int i = 0; i < side; ++i) {
          Agent a{.id = people.size() + 1};
          const double y = (i % 4 - 1.5) * 0.9 + off(random);
          a.state.position_W_m = {-way * (6.0 + 0.9 * (i / 4) + off(random)), y};
          a.state.heading_rad = way > 0.0 ? 0.0 : std::numbers::pi;
          a.state.phase_rad = 0.37 * static_cast<double>(a.id);
          a.traits.omega_rad_s = 6.0;
          a.traits.radius_m = 0.2;
          a.traits.goal_W_m = {way * 60.0, y};
          people.push_back(a);
        }
      }
      Rules rules;
      rules.heading = {.kind = HeadingKind::goal, .gain = 1.5, .avoid = true};
      Crowd crowd({.dt_s = 0.02});
      crowd.add_group({rules, SpeedFunction(0.22, {}, {}), {}});
      crowd.add(0, people);
      crowd.set_obstacles({}, walls);
      const auto peer = Rvo2::make(crowd, {}, walls);
      const auto ours = move_by_engine(std::move(crowd), 1);
      const auto time_of = [&](Movers& movers) {
        while (movers.time_s() < 120.0) {
          movers.step();
          bool through = true;
          for (int i = 0; i < movers.size(); ++i) {
            through = through && movers.position_W_m(i).x() * (i < side ? 1.0 : -1.0) > 3.0;
          }
          if (through) break;
        }
        return movers.time_s();
      };
      ours_s += time_of(*ours);
      peers_s += time_of(*peer);
    }
    std::cout << side << " a side: " << ours_s / 5.0 << " s, RVO2 " << peers_s / 5.0 << " s\n";
    EXPECT_LT(ours_s, 2.0 * peers_s) << side;
  }
}

}  // namespace
}  // namespace mimesis::crowd
