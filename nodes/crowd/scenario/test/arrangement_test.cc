#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <set>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {
namespace {

using Eigen::Vector2d;

Group group(int count, Arrangement arrangement) {
  Group g;
  g.count = count;
  g.start.arrangement = arrangement;
  g.start.phase = PhaseStart::equal;
  return g;
}

double least_distance(const std::vector<AgentStart>& all) {
  double least = INFINITY;
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      least = std::min(least, (all[i].p_W_m - all[j].p_W_m).norm());
    }
  }
  return least;
}

TEST(Starts, GridHasRowsBehindEachOtherInThePathsFrame) {
  Group g = group(6, Arrangement::grid);
  g.start.columns = 3;
  g.start.spacing_m = 2.0;
  g.start.across_m = 1.0;
  g.origin_x_m = 10.0;
  g.heading_rad = 0.5 * std::numbers::pi;  // z is y of W, left of it is -x
  const auto all = starts(g, 5.0, 1);
  ASSERT_EQ(all.size(), 6U);
  EXPECT_TRUE(all[0].p_W_m.isApprox(Vector2d(9.0, 0.0))) << all[0].p_W_m.transpose();
  EXPECT_TRUE(all[2].p_W_m.isApprox(Vector2d(11.0, 0.0)));
  EXPECT_TRUE(all[4].p_W_m.isApprox(Vector2d(10.0, -2.0)));
  EXPECT_DOUBLE_EQ(all[4].heading_rad, 0.5 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(all[4].eigenfrequency_rad_s, 5.0);
}

TEST(Starts, CircleFacesItsCentreAndSwapsThroughIt) {
  Group g = group(250, Arrangement::circle);
  g.start.radius_m = 30.0;
  g.origin_x_m = 1.0;
  g.goals.aim = Aim::opposite;
  const auto all = starts(g, 5.0, 1);
  const auto goals = first_goals(g, all);
  for (std::size_t i = 0; i < all.size(); ++i) {
    const Vector2d to_goal = goals[i] - all[i].p_W_m;
    EXPECT_NEAR(to_goal.norm(), 60.0, 1e-9);
    EXPECT_NEAR(math::wrap_pi(std::atan2(to_goal.y(), to_goal.x()) - all[i].heading_rad), 0.0,
                1e-9);
  }
  EXPECT_NEAR(least_distance(all), 60.0 * std::sin(std::numbers::pi / 250), 1e-9);
}

TEST(Starts, BoxLeavesRoomBetweenBodiesAndSaysWhenItIsFull) {
  Group g = group(60, Arrangement::box);
  g.start.length_m = 10.0;
  g.start.width_m = 6.0;
  const auto all = starts(g, 5.0, 7);
  EXPECT_GE(least_distance(all), 0.75);
  for (const AgentStart& a : all) {
    EXPECT_LE(std::abs(a.p_W_m.x()), 5.0);
    EXPECT_LE(std::abs(a.p_W_m.y()), 3.0);
  }
  g.start.length_m = 2.0;
  EXPECT_THROW((void)starts(g, 5.0, 7), ConfigError);
}

TEST(Starts, SameSeedSameBitsAndRandomPhasesFillTheCycle) {
  Group g = group(400, Arrangement::line);
  g.start.phase = PhaseStart::random;
  g.start.jitter_m = 0.1;
  g.spread_rad_s = 0.5;
  const auto a = starts(g, 5.0, 3), b = starts(g, 5.0, 3), c = starts(g, 5.0, 4);
  Vector2d mean(0.0, 0.0);
  bool differs = false;
  double least = 9.0, most = 0.0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].phase_rad, b[i].phase_rad);
    EXPECT_EQ(a[i].p_W_m, b[i].p_W_m);
    differs = differs || a[i].phase_rad != c[i].phase_rad;
    EXPECT_NEAR(a[i].p_W_m.x(), -1.2 * static_cast<double>(i), 0.1);
    mean += Vector2d(std::cos(a[i].phase_rad), std::sin(a[i].phase_rad)) / 400.0;
    least = std::min(least, a[i].eigenfrequency_rad_s);
    most = std::max(most, a[i].eigenfrequency_rad_s);
  }
  EXPECT_TRUE(differs);
  EXPECT_LT(mean.norm(), 0.15);  // three times 1/sqrt(400)
  EXPECT_GE(least, 4.5);
  EXPECT_LE(most, 5.5);
  EXPECT_GT(most - least, 0.9);
}

TEST(Starts, SpreadPhasesAreEven) {
  Group g = group(8, Arrangement::line);
  g.start.phase = PhaseStart::spread;
  std::set<double> phases;
  for (const AgentStart& a : starts(g, 5.0, 1)) phases.insert(a.phase_rad);
  double widest = math::kTwoPi - *phases.rbegin() + *phases.begin();
  for (auto it = phases.begin(); std::next(it) != phases.end(); ++it) {
    widest = std::max(widest, *std::next(it) - *it);
  }
  EXPECT_LT(widest, math::kTwoPi * 0.24);  // golden section: largest gap of 8 is phi^-3 = 0.236
}

TEST(Places, OfAGridARowALineAndAWedge) {
  Group g = group(5, Arrangement::line);
  g.formation = {.shape = Shape::grid, .spacing_m = 2.0, .across_m = 1.0, .columns = 2};
  auto p = places(g);
  EXPECT_DOUBLE_EQ(p[4].place_m, -4.0);
  EXPECT_DOUBLE_EQ(p[4].lane_m, 0.5);
  EXPECT_DOUBLE_EQ(p[1].lane_m, -0.5);
  g.formation.shape = Shape::row;
  p = places(g);
  EXPECT_DOUBLE_EQ(p[0].lane_m, 2.0);
  EXPECT_DOUBLE_EQ(p[3].place_m, 0.0);
  g.formation.shape = Shape::line;
  EXPECT_DOUBLE_EQ(places(g)[3].place_m, -6.0);
  g.formation.shape = Shape::wedge;
  p = places(g);
  EXPECT_DOUBLE_EQ(p[0].place_m, 0.0);
  EXPECT_DOUBLE_EQ(p[1].lane_m, 1.0);
  EXPECT_DOUBLE_EQ(p[2].lane_m, -1.0);
  EXPECT_DOUBLE_EQ(p[3].place_m, -4.0);
}

TEST(Places, FollowFromConsistentDistances) {
  Group g = group(4, Arrangement::line);
  g.formation.shape = Shape::distances;
  g.formation.distances = {{2, 3, 1.5}, {0, 1, 1.0}, {3, 1, -0.5}, {0, 2, 0.0}};
  const auto p = places(g);  // 0-2-3-1: 0 + 1.5 - 0.5 is d_01
  EXPECT_DOUBLE_EQ(p[1].place_m, -1.0);
  EXPECT_DOUBLE_EQ(p[2].place_m, 0.0);
  EXPECT_DOUBLE_EQ(p[3].place_m, -1.5);
  g.formation.distances[3].ahead_m = 0.1;
  EXPECT_THROW((void)places(g), ConfigError);
  g.formation.distances = {{0, 1, 1.0}, {1, 0, 1.0}};  // not antisymmetric
  EXPECT_THROW((void)places(g), ConfigError);
}

}  // namespace
}  // namespace mimesis::crowd
