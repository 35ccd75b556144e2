#include "nodes/crowd/engine/testing/navigation.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

namespace mimesis::crowd {
namespace {

using Eigen::Vector2d;

TEST(Heading, LeftIsLeft) {
  const Pedestrian self{{0, 0}, 0.0, 1.3};
  const NavigationParams p;
  EXPECT_NEAR(goal_term(self, {1, 1}), std::sin(std::numbers::pi / 4),
              1e-15);  // goal to the left: + turn
  EXPECT_LT(goal_term(self, {1, -1}), 0.0);
  EXPECT_LT(avoidance_term(self, {{1, 0.5}, 0, 0}, p), 0.0);  // obstacle to the left: - turn
  EXPECT_GT(avoidance_term(self, {{1, -0.5}, 0, 0}, p), 0.0);
  // over the cut of the angle, the same as anywhere else
  const Pedestrian back{{0, 0}, 3.1, 1.3};
  EXPECT_NEAR(avoidance_term(back, {{std::cos(3.4), std::sin(3.4)}, 0, 0}, p),
              avoidance_term(self, {{std::cos(0.3), std::sin(0.3)}, 0, 0}, p), 1e-12);
}

TEST(Heading, TermsInClosedForm) {
  NavigationParams p;
  p.keep_right_rad = 0.0;
  const Pedestrian self{{0, 0}, 0.2, 1.0}, other{{0.6, 0.8}, 0.0, 0.0};
  const double off = 0.2 - std::atan2(0.8, 0.6);
  EXPECT_NEAR(avoidance_term(self, other, p),
              std::sin(off) * std::exp(-off * off / (2 * 0.36)) * std::exp(-1.0 / (2 * 0.64)),
              1e-12);
}

TEST(ClosestApproach, InClosedForm) {
  const Pedestrian self{{0, 0}, 0.0, 1.0};
  // meets at (2, 0) after 2 s
  const auto c = closest_approach(self, {{2, -2}, std::numbers::pi / 2, 1.0});
  ASSERT_TRUE(c.ahead);
  EXPECT_NEAR(c.time_s, 2.0, 1e-12);
  EXPECT_NEAR(c.distance_m, 0.0, 1e-12);
  EXPECT_NEAR(c.direction_rad, 0.0, 1e-12);
  // head on, passing at 0.4 m on the left
  const auto h = closest_approach(self, {{4, 0.4}, std::numbers::pi, 1.0});
  ASSERT_TRUE(h.ahead);
  EXPECT_NEAR(h.time_s, 2.0, 1e-12);
  EXPECT_NEAR(h.distance_m, 0.4, 1e-12);
  EXPECT_NEAR(h.direction_rad, std::atan2(0.4, 2.0), 1e-12);
}

TEST(ClosestApproach, NoneSideBySideOrInThePast) {
  const NavigationParams p;
  const Pedestrian self{{0, 0}, 0.0, 1.0};
  for (const Pedestrian& other :
       {Pedestrian{{0, 1}, 0.0, 1.0}, Pedestrian{{3, 0}, 0.0, 1.0},
        Pedestrian{{-3, 0}, std::numbers::pi, 1.0}, Pedestrian{{-2, 0}, 0.0, 0.5}}) {
    EXPECT_FALSE(closest_approach(self, other).ahead);
    EXPECT_EQ(prediction_term(self, other, p), 0.0);
  }
}

/// Everybody walks to their goal and stops there.
struct Scene {
  std::vector<Pedestrian> walkers;
  std::vector<Vector2d> goals;
  std::vector<Pedestrian> pillars;
  double closest = std::numeric_limits<double>::infinity();
  std::vector<bool> arrived = {};

  void run(double seconds) {
    arrived.assign(walkers.size(), false);
    const double dt = 0.02;
    for (double t = 0.0; t < seconds; t += dt) {
      std::vector<double> rate(walkers.size());
      for (std::size_t i = 0; i < walkers.size(); ++i) {
        std::vector<Pedestrian> others = pillars;
        for (std::size_t j = 0; j < walkers.size(); ++j) {
          if (j == i) continue;
          if (!arrived[i] && !arrived[j]) {
            closest = std::min(closest, (walkers[i].position_W_m - walkers[j].position_W_m).norm());
          }
          if (!arrived[j]) others.push_back(walkers[j]);
        }
        for (const Pedestrian& o : pillars) {
          closest = std::min(closest, (walkers[i].position_W_m - o.position_W_m).norm());
        }
        rate[i] = heading_rate(walkers[i], goals[i], 1.0, others);
      }
      for (std::size_t i = 0; i < walkers.size(); ++i) {
        Pedestrian& w = walkers[i];
        if ((w.position_W_m - goals[i]).norm() < 0.5) arrived[i] = true;
        if (arrived[i]) continue;
        w.heading_rad += dt * rate[i];
        w.position_W_m +=
            dt * w.speed_m_s * Vector2d(std::cos(w.heading_rad), std::sin(w.heading_rad));
      }
    }
  }
  bool all_arrived() const {
    return std::all_of(arrived.begin(), arrived.end(), [](bool a) { return a; });
  }
};

TEST(Navigation, ReachesAGoalBehindItself) {
  Scene s{{{{0, 0}, 0.0, 1.3}}, {{-8, 0.5}}, {}};
  s.run(15.0);
  EXPECT_TRUE(s.all_arrived());
}

TEST(Navigation, TwoHeadOnPassEachOther) {
  Scene s{{{{-5, 0}, 0.0, 1.3}, {{5, 0}, std::numbers::pi, 1.3}}, {{5, 0}, {-5, 0}}, {}};
  s.run(6.0);
  EXPECT_LT(s.walkers[0].position_W_m.y(), 0.05);  // both kept to their right
  s.run(6.0);
  EXPECT_TRUE(s.all_arrived());
  EXPECT_GT(s.closest, 0.6);
}

TEST(Navigation, FourCrossInTheMiddle) {
  Scene s{};
  for (int i = 0; i < 4; ++i) {
    const Vector2d from =
        6.0 * Vector2d(std::cos(std::numbers::pi / 2 * i), std::sin(std::numbers::pi / 2 * i));
    s.walkers.push_back({from, std::numbers::pi / 2 * i + std::numbers::pi, 1.3});
    s.goals.push_back(-from);
  }
  s.run(25.0);
  EXPECT_TRUE(s.all_arrived());
  EXPECT_GT(s.closest, 0.5);
}

TEST(Navigation, GoesAroundAPillarInTheWay) {
  Scene s{{{{-4, 0}, 0.0, 1.3}}, {{4, 0}}, {{{0, 0}, 0.0, 0.0}}};
  s.run(12.0);
  EXPECT_TRUE(s.all_arrived());
  EXPECT_GT(s.closest, 0.5);
}

}  // namespace
}  // namespace mimesis::crowd
