#include "nodes/walker/approach.h"

#include <gtest/gtest.h>

#include "common/testing/no_malloc.h"

namespace mimesis::walker {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;

TEST(Approach, EndsAtTheGoalAtRestWithinTheSpeedThatIsAllowed) {
  Approach approach;
  const VectorXd from = Vector2d(0.0, 1.0), to = Vector2d(0.6, 0.9), fastest = Vector2d(4.0, 1.0);
  approach.start(from, to, fastest, 0.1, 0.5);
  // 1.875 · 0.6 / (0.1 · 4) = 2.8125 s; the other joint needs 1.875 s
  EXPECT_NEAR(approach.duration_s(), 2.8125, 1e-12);
  VectorXd last = from;
  double most = 0.0;
  int ticks = 0;
  for (; !approach.done(); ++ticks) {
    approach.step(0.005);
    // rates are those of the positions
    EXPECT_LT(((approach.q() - last) / 0.005 - approach.dq()).norm(), 5e-3);
    most = std::max(most, std::abs(approach.dq()[0]));
    last = approach.q();
  }
  EXPECT_EQ(ticks, 563);
  EXPECT_NEAR(most, 0.4, 1e-4);
  EXPECT_TRUE(approach.q().isApprox(to, 1e-12));
  EXPECT_LT(approach.dq().norm(), 1e-12);
}

TEST(Approach, ShortWaysTakeTheLeastTimeAndHalfTheWayIsInTheMiddle) {
  Approach approach;
  const VectorXd from = Vector2d(0.0, 0.0), to = Vector2d(0.01, -0.02), fastest = Vector2d(4, 4);
  approach.start(from, to, fastest, 0.1, 1.0);
  EXPECT_DOUBLE_EQ(approach.duration_s(), 1.0);
  for (int i = 0; i < 100; ++i) approach.step(0.005);
  EXPECT_TRUE(approach.q().isApprox(0.5 * to, 1e-12));
}

TEST(Approach, StepsDoNotAllocate) {
  Approach approach;
  const VectorXd a = VectorXd::Zero(30), b = VectorXd::Ones(30);
  approach.start(a, b, 10.0 * b, 0.1, 1.0);
  const testing::NoMalloc guard;
  approach.step(0.005);
}

}  // namespace
}  // namespace mimesis::walker
