// Two agents that meet where there is hardly room for both.
#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "nodes/crowd/engine/test/walkers.h"

namespace mimesis::crowd {
namespace {

/// In the middle between two agents that come head on; side by side they are 1.2 m wide.
struct Narrow {
  std::vector<Pillar> pillars{};
  std::vector<Wall> walls{};
  Narrow(double wide_m, bool passage) {
    for (const double side : {-1.0, 1.0}) {
      const double y = side * 0.5 * wide_m;
      if (passage) walls.push_back({{-1.0, y}, {1.0, y}});
      if (!passage) pillars.push_back({{0.0, y + side * 0.4}, 0.4});
    }
  }
};

std::vector<Agent> head_on(double y_m, bool second_from_left = false) {
  const Eigen::Vector2d left(-4.0, y_m), right(4.0, y_m);
  std::vector<Agent> both{walker(1, left, right), walker(2, right, left)};
  if (second_from_left) both = {walker(1, right, left), walker(2, left, right)};
  both[1].state.phase_rad = both[0].state.phase_rad;  // nothing but their names tells them apart
  return both;
}

TEST(Gap, TwoWhoMeetPassOrOneStepsBack) {
  const double fastest = 6.0 * gait().most();
  for (const double wide_m : {0.7, 0.9, 1.1, 1.3, 1.7}) {
    for (const double y_m : {-0.1, 0.0, 0.1}) {
      for (const bool passage : {false, true}) {
        SCOPED_TRACE(::testing::Message() << wide_m << " m, from " << y_m << ", " << passage);
        Crowd crowd({.dt_s = 0.02});
        crowd.add_group(walkers());
        crowd.add(0, head_on(y_m));
        const Narrow gap(wide_m, passage);
        crowd.set_obstacles(gap.pillars, gap.walls);
        for (int i = 0; i < 50 * 20; ++i) {
          crowd.step();
          ASSERT_EQ(crowd.contacts().overlapping, 0) << crowd.time_s();
          for (int k = 0; k < 2; ++k) {
            ASSERT_LE(crowd.agent(k).state.velocity_W_m_s.norm(), fastest);
          }
        }
        EXPECT_EQ(arrived(crowd, 0.1), 2);
      }
    }
  }
}

TEST(Gap, WhoIsHeldStepsToItsRight) {
  Crowd crowd({.dt_s = 0.02});
  crowd.add_group(walkers());
  crowd.add(0, std::vector<Agent>{walker(1, {-0.31, 0.0}, {4.0, 0.0}),
                                  walker(2, {0.31, 0.0}, {-4.0, 0.0})});
  crowd.step();
  EXPECT_LT(crowd.agent(0).state.velocity_W_m_s.y(), -0.2);
  EXPECT_GT(crowd.agent(1).state.velocity_W_m_s.y(), 0.2);
  EXPECT_GE(least_distance(crowd), 0.6);
}

TEST(Gap, TheOneNamedFirstGoesOn) {
  for (const bool second_from_left : {false, true}) {
    Crowd crowd({.dt_s = 0.02});
    crowd.add_group(walkers());
    crowd.add(0, head_on(0.0, second_from_left));
    const Narrow gap(1.1, true);
    crowd.set_obstacles(gap.pillars, gap.walls);
    const double on = second_from_left ? -1.0 : 1.0;  // where the first goes
    double first_back = 0.0, second_back = 0.0;
    for (int i = 0; i < 50 * 20; ++i) {
      const double a = crowd.x_m()[0], b = crowd.x_m()[1];
      crowd.step();
      first_back = std::max(first_back, on * (a - crowd.x_m()[0]));
      second_back = std::max(second_back, on * (crowd.x_m()[1] - b));
    }
    EXPECT_LT(first_back, 0.05);  // it looks for a way round meanwhile
    EXPECT_GT(second_back, 1e-3);
    EXPECT_LT(second_back, 0.02 * AvoidSettings{}.separate_m_s + 1e-9);  // not faster
    EXPECT_EQ(arrived(crowd, 0.1), 2);
  }
}

}  // namespace
}  // namespace mimesis::crowd
