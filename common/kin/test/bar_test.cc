#include <gtest/gtest.h>

#include <cmath>

#include "common/kin/table.h"

namespace mimesis::kin {
namespace {

const BarShape kBar{.x = 0.52,
                    .surface_z = -0.01,
                    .half_width = 0.34,
                    .height = 0.375,
                    .ball_radius = 0.035,
                    .max_spacing = 0.045};

TEST(Bar, LeavesExactlyItsHeightBelowTheBar) {
  double lowest = INFINITY;
  for (const Ball& ball : bar_balls(kBar)) {
    if (std::abs(ball.center.y()) < 0.3) lowest = std::min(lowest, ball.center.z() - ball.radius);
  }
  EXPECT_NEAR(lowest - kBar.surface_z, kBar.height, 1e-12);
  EXPECT_NEAR(bar_center(kBar).z(), 0.40, 1e-12);
}

TEST(Bar, PostsStandOnTheTableAndReachTheBar) {
  double lowest = INFINITY, highest = -INFINITY;
  for (const Ball& ball : bar_balls(kBar)) {
    lowest = std::min(lowest, ball.center.z() - ball.radius);
    highest = std::max(highest, ball.center.z());
    EXPECT_DOUBLE_EQ(ball.center.x(), 0.52);
    EXPECT_LE(std::abs(ball.center.y()), 0.34 + 1e-12);
  }
  EXPECT_NEAR(lowest, kBar.surface_z, 1e-12);
  EXPECT_NEAR(highest, 0.40, 1e-12);
}

TEST(Bar, HasNoGapAlongTheBarAndNoBallTwice) {
  const std::vector<Ball> balls = bar_balls(kBar);
  for (double y = -0.34; y <= 0.34; y += 0.005) {
    double nearest = INFINITY;
    for (const Ball& ball : balls) {
      nearest = std::min(nearest, (ball.center - Eigen::Vector3d(0.52, y, 0.40)).norm());
    }
    EXPECT_LE(nearest, kBar.max_spacing / 2 + 1e-12) << "y = " << y;
  }
  for (std::size_t i = 0; i < balls.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_GT((balls[i].center - balls[j].center).norm(), 0.03) << i << " and " << j;
    }
  }
}

}  // namespace
}  // namespace mimesis::kin
