#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <span>
#include <vector>

#include "common/math/circle.h"
#include "common/parallel/team.h"
#include "common/testing/no_malloc.h"
#include "nodes/crowd/engine/test/walkers.h"
#include "nodes/crowd/engine/testing/navigation.h"

namespace mimesis::crowd {
namespace {

TEST(Navigate, SaysWhatAvoidanceAddedToAHeading) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(walkers());
  GroupSettings alone = walkers();
  alone.rules.heading.avoid = false;
  crowd.add_group(alone);
  const Agent self = walker(1, {0.0, 0.0}, {9.0, 0.0}), other = walker(2, {1.0, 0.4}, {9.0, 2.0});
  crowd.add(0, std::vector<Agent>{self, other});
  crowd.add(1, std::vector<Agent>{walker(3, {50.0, 0.0}, {60.0, 0.0})});
  EXPECT_TRUE(std::isnan(crowd.avoidance_rad_s(0)));
  crowd.step();
  const NavigationParams p{};
  const Pedestrian from{{0.0, 0.0}, 0.0, 0.0};
  const Pedestrian to{{1.0, 0.4}, other.state.heading_rad, 0.0};  // both stand at the beginning
  EXPECT_NEAR(crowd.avoidance_rad_s(0), p.avoid_1_s * avoidance_term(from, to, p), 1e-3);
  EXPECT_LT(crowd.avoidance_rad_s(0), -0.1);
  EXPECT_EQ(crowd.avoidance_rad_s(2), 0.0);
  crowd.remove(2);
  EXPECT_TRUE(std::isnan(crowd.avoidance_rad_s(0)));
}

TEST(Navigate, APillarTurnsAsAnAgentJustBehindItsSurfaceWould) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(walkers());
  const Pillar pillar{{1.2, 0.3}, 0.5};
  crowd.set_obstacles(std::span(&pillar, 1), {});
  crowd.add(0, std::vector<Agent>{walker(1, {0.0, 0.0}, {9.0, 0.0})});
  crowd.step();
  const Eigen::Vector2d n = pillar.position_W_m.normalized();
  const double surface = pillar.position_W_m.norm() - pillar.radius_m;
  const NavigationParams p{};
  const Pedestrian from{{0.0, 0.0}, 0.0, 0.0}, felt{(surface + 0.3) * n, 0.0, 0.0};
  EXPECT_NEAR(crowd.avoidance_rad_s(0), p.avoid_1_s * avoidance_term(from, felt, p), 1e-3);
  EXPECT_LT(crowd.avoidance_rad_s(0), -0.1);
}

TEST(Navigate, WhoIsTurnedAwayFromItsLaneListensLessToOthers) {
  for (const double heading : {0.4, 2.5}) {
    Crowd crowd({.dt_s = 0.02});
    GroupSettings lane = walkers();
    lane.rules.heading = {.kind = HeadingKind::lane, .gain = 0.6, .ahead_m = 2.0, .avoid = true};
    crowd.add_group(lane);
    Agent self = walker(1, {0.0, 0.0}, {1.0, 0.0}), other = walker(2, {-0.7, 0.3}, {5.0, 0.0});
    if (heading < 1.0) other.state.position_W_m.x() = 0.7;
    self.state.heading_rad = heading;
    crowd.add(0, std::vector<Agent>{self, other});
    crowd.step();
    const double avoid = crowd.avoidance_rad_s(0);
    EXPECT_GT(std::abs(avoid), 0.05);
    const double share = heading < 1.0 ? 1.0 : 1.0 + std::cos(heading);
    // in a step of 0.02 s, linearly implicit over the width σ_φ of its terms
    const double steered = share * avoid / (1.0 + 0.02 / 0.6 * std::abs(share * avoid));
    EXPECT_NEAR(crowd.agent(0).state.heading_rate_rad_s, -6.0 * 0.6 * std::sin(heading) + steered,
                1e-9);
  }
}

TEST(Navigate, StepsOfAQuarterOfASecondKeepDiscsApartAndHoldNobodyFarAside) {
  for (const double side : {-1.0, 1.0}) {
    for (double across = 0.0; across < 0.8; across += 0.05) {
      CrowdSettings settings{.dt_s = 0.25};
      settings.avoid.navigation.avoid_1_s = settings.avoid.navigation.predict_1_s = 0.0;
      Crowd crowd(settings);
      crowd.add_group(walkers());
      const double y = side * across;
      crowd.add(0, std::vector<Agent>{walker(1, {-2.0, 0.0}, {90.0, 0.0}),
                                      walker(2, {2.0, y}, {-90.0, y})});
      for (int i = 0; i < 12; ++i) {
        crowd.step();
        EXPECT_EQ(crowd.contacts().overlapping, 0) << y;
      }
      const double way = crowd.x_m()[0] + 2.0;
      EXPECT_GT(way, across > 0.64 ? 0.95 * 3.0 * 6.0 * 0.22 : 0.0) << y;
    }
  }
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

/// A mixed crowd: lanes and goals, phases, spacing, pillars and a wall.
Crowd busy(std::vector<Agent> all, int shuffle) {
  Crowd crowd({.dt_s = 0.02});
  Rules rules;
  rules.frequency = {{Topology::ring}, 0.05, 1.0, 4.0};
  rules.length = {{Topology::all_to_all}, 0.0005, 0.4};
  rules.phase = {{Topology::all_to_all}, 0.002};
  rules.heading = {.kind = HeadingKind::lane, .avoid = true};
  crowd.add_group({rules, gait(), {{0.0, 0.0}, 0.3}});
  crowd.add_group(walkers());
  std::mt19937 random(static_cast<unsigned>(shuffle));
  if (shuffle > 0) std::shuffle(all.begin(), all.end(), random);
  for (const Agent& a : all) crowd.add(a.id % 3 == 0 ? 1 : 0, std::span(&a, 1));
  const std::vector<Pillar> pillars{{{3.0, 3.0}, 0.5}, {{-4.0, 2.0}, 1.0}};
  const std::vector<Wall> walls{{{-8.0, -9.0}, {8.0, -9.5}}};
  crowd.set_obstacles(pillars, walls);
  return crowd;
}

std::vector<Agent> busy_agents(int n) {
  std::vector<Agent> all;
  std::mt19937 random(4);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2d p(20.0 * unit(random), 20.0 * unit(random));
    all.push_back(walker(static_cast<AgentId>(i + 1), p, -p));
    all.back().traits.place_m = p.x();
    all.back().traits.lane_m = p.y();
    all.back().state.heading_rad = 0.3;
  }
  return all;
}

void expect_same_bits(const Crowd& a, const Crowd& b) {
  ASSERT_EQ(a.size(), b.size());
  for (int i = 0; i < a.size(); ++i) {
    const Agent x = a.agent(i), y = *b.find(x.id);
    EXPECT_EQ(x.state.position_W_m, y.state.position_W_m);
    EXPECT_EQ(x.state.velocity_W_m_s, y.state.velocity_W_m_s);
    EXPECT_EQ(x.state.heading_rad, y.state.heading_rad);
    EXPECT_EQ(x.state.phase_rad, y.state.phase_rad);
    EXPECT_EQ(x.state.length, y.state.length);
  }
}

TEST(Navigate, NeitherThreadsNorOrderOfJoiningChangeABit) {
  const auto all = busy_agents(1500);
  Crowd crowd = busy(all, 0), same = busy(all, 9), shared = busy(all, 0);
  parallel::Team team(3);
  for (int i = 0; i < 100; ++i) {
    crowd.step();
    same.step();
    shared.step(&team);
  }
  EXPECT_GT(crowd.contacts().held, 0);
  expect_same_bits(crowd, shared);
  expect_same_bits(crowd, same);
  EXPECT_EQ(crowd.contacts().least_gap_m, shared.contacts().least_gap_m);
  EXPECT_EQ(crowd.contacts().held, shared.contacts().held);
}

TEST(Navigate, AStepDoesNotAllocate) {
  Crowd crowd = busy(busy_agents(300), 0);
  parallel::Team team(2);
  crowd.step();
  crowd.step(&team);
  testing::NoMalloc guard;
  for (int i = 0; i < 50; ++i) crowd.step(i % 2 == 0 ? &team : nullptr);
}

TEST(Navigate, WhoBeginsInOthersLeavesThemSlowly) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(walkers());
  std::vector<Agent> all;
  for (int i = 0; i < 30; ++i) {  // in one heap, some at the same point
    const Eigen::Vector2d p(0.1 * (i % 5), 0.1 * (i % 3));
    all.push_back(walker(static_cast<AgentId>(i + 1), p, p));
  }
  all.push_back(walker(99, {6.0, 0.0}, {6.0, 0.0}));
  crowd.add(0, all);
  double fastest = 0.0, far = 0.0;
  for (int i = 0; i < 1500; ++i) {
    crowd.step();
    for (int k = 0; k < 30; ++k) {
      fastest = std::max(fastest, crowd.agent(k).state.velocity_W_m_s.norm());
    }
    far = std::max(far, std::abs(crowd.find(99)->state.position_W_m.x() - 6.0));
  }
  EXPECT_LT(fastest, 6.0 * gait().most());  // only by walking
  EXPECT_LT(far, 0.5);
  EXPECT_EQ(crowd.contacts().overlapping, 0);
  EXPECT_GE(least_distance(crowd), 0.6 - 1e-9);
}

TEST(Navigate, PillarsAndWallsAreNotEntered) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(walkers());
  std::vector<Agent> all;
  for (int i = 0; i < 60; ++i) {
    all.push_back(walker(static_cast<AgentId>(i + 1), {-10.0 - i / 6, i % 6 - 2.5},
                         {10.0 + i / 6, i % 6 - 2.5}));
  }
  crowd.add(0, all);
  const std::vector<Pillar> pillars{{{0.0, 0.0}, 0.8}, {{3.0, -2.0}, 0.4}};
  const std::vector<Wall> walls{{{-5.0, 5.0}, {5.0, 5.0}}, {{-5.0, -5.0}, {5.0, -5.0}}};
  crowd.set_obstacles(pillars, walls);
  for (int i = 0; i < 50 * 60; ++i) {
    crowd.step();
    ASSERT_EQ(crowd.contacts().overlapping, 0);
    for (int k = 0; k < crowd.size(); ++k) {
      const Eigen::Vector2d p = crowd.agent(k).state.position_W_m;
      for (const Pillar& o : pillars) ASSERT_GE((p - o.position_W_m).norm(), o.radius_m + 0.3);
      ASSERT_TRUE(std::abs(p.x()) > 5.0 || std::abs(std::abs(p.y()) - 5.0) >= 0.3);
    }
  }
  EXPECT_EQ(arrived(crowd, 0.3), 60);
}

TEST(Navigate, WhoDoesNotYieldIsGivenRoom) {
  // A robot drives through a standing crowd and into walkers; all make room alone.
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(walkers());
  crowd.add_group(walkers());
  std::vector<Agent> all;
  for (int i = 0; i < 20; ++i) {
    all.push_back(
        walker(static_cast<AgentId>(i + 2), {8.0 + 1.2 * i, 0.02 * (i % 3)}, {-20.0, 0.1 * i}));
  }
  crowd.add(0, all);
  Agent robot = walker(1, {0.0, 0.0}, {50.0, 0.0});
  robot.role = Role::external;
  robot.state.velocity_W_m_s = {0.4, 0.0};
  crowd.add(1, std::span(&robot, 1));
  for (int i = 0; i < 50 * 40; ++i) {
    crowd.step();
    ASSERT_EQ(crowd.contacts().overlapping, 0) << crowd.time_s();
  }
  EXPECT_NEAR(crowd.find(1)->state.position_W_m.x(), 16.0, 1e-5);
  EXPECT_TRUE(crowd.wish(1).has_value());
  for (int i = 0; i < 20; ++i) {
    EXPECT_LT(crowd.find(static_cast<AgentId>(i + 2))->state.position_W_m.x(), 0.0);
  }
}

}  // namespace
}  // namespace mimesis::crowd
