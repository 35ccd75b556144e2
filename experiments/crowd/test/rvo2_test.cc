// The peer does the measured work: it moves the same agents.
#include "experiments/crowd/rvo2.h"

#include <gtest/gtest.h>

#include <algorithm>

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

}  // namespace
}  // namespace mimesis::crowd
