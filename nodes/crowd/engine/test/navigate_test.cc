#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

#include "common/math/circle.h"
#include "common/parallel/team.h"
#include "common/testing/no_malloc.h"
#include "nodes/crowd/engine/crowd.h"

namespace mimesis::crowd {
namespace {

SpeedFunction gait() {
  const std::vector<double> cosine{0.02, 0.05}, sine{0.01, -0.03};
  return {0.22, cosine, sine};
}

GroupSettings walkers() {
  Rules rules;
  rules.heading = {.kind = HeadingKind::goal, .gain = 1.0, .avoid = true};
  return {rules, gait(), {}};
}

Agent walker(AgentId id, Eigen::Vector2d from, Eigen::Vector2d to) {
  Agent a{.id = id};
  a.traits.omega_rad_s = 6.0;
  a.traits.goal_W_m = to;
  a.state.position_W_m = from;
  const Eigen::Vector2d way = to - from;
  a.state.heading_rad = std::atan2(way.y(), way.x());
  a.state.phase_rad = 0.37 * static_cast<double>(id);
  return a;
}

double least_distance(const Crowd& c) {
  double least = 1e9;
  for (std::size_t i = 0; i < c.ids().size(); ++i) {
    for (std::size_t j = i + 1; j < c.ids().size(); ++j) {
      least = std::min(least, std::hypot(c.x_m()[i] - c.x_m()[j], c.y_m()[i] - c.y_m()[j]));
    }
  }
  return least;
}

int arrived(const Crowd& c, double within_m) {
  int n = 0;
  for (int i = 0; i < c.size(); ++i) {
    const Agent a = c.agent(i);
    n += (a.state.position_W_m - a.traits.goal_W_m).norm() < within_m;
  }
  return n;
}

TEST(Navigate, TwoHundredAndFiftyChangePlacesAcrossACircle) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(walkers());
  std::vector<Agent> all;
  for (int i = 0; i < 250; ++i) {
    const double angle = math::kTwoPi * i / 250;
    const Eigen::Vector2d p = 40.0 * Eigen::Vector2d(std::cos(angle), std::sin(angle));
    all.push_back(walker(static_cast<AgentId>(i + 1), p, -p));
  }
  crowd.add(0, all);
  double least = 1e9;
  for (int i = 0; i < 50 * 90; ++i) {
    crowd.step();
    EXPECT_EQ(crowd.contacts().overlapping, 0);
    least = std::min(least, crowd.contacts().least_gap_m);
  }
  EXPECT_GE(least, 0.0);
  EXPECT_EQ(arrived(crowd, 0.5), 250);
  EXPECT_GE(least_distance(crowd), 0.6);
}

TEST(Navigate, ThousandHeadOnPairsPass) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(walkers());
  std::vector<Agent> all;
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d a(0.0, 20.0 * i), b(10.0, 20.0 * i);
    all.push_back(walker(static_cast<AgentId>(2 * i + 1), a, b));
    all.push_back(walker(static_cast<AgentId>(2 * i + 2), b, a));
  }
  crowd.add(0, all);
  double least = 1e9;
  for (int i = 0; i < 50 * 20; ++i) {
    crowd.step();
    least = std::min(least, crowd.contacts().least_gap_m);
    ASSERT_EQ(crowd.contacts().overlapping, 0);
  }
  EXPECT_EQ(arrived(crowd, 0.1), 2000);
}

}  // namespace
}  // namespace mimesis::crowd
