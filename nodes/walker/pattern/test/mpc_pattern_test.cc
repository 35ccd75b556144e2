// What is walked without a solution.
#include "nodes/walker/pattern/mpc_pattern.h"

#include <gtest/gtest.h>

#include <utility>

#include "common/testing/no_malloc.h"
#include "nodes/walker/pattern/test/patterns.h"

namespace mimesis::walker {
namespace {

using namespace testing;
using mimesis::testing::NoMalloc;

/// A generator whose programs are not solved any more, from one tick to another.
template <typename Mpc>
void stop_without_plans() {
  const GaitSettings gait;
  const Kind kind{"without plans", {}, 0.03, 0.0, true};
  for (int at = 0; at < 640; at += 71) {
    SCOPED_TRACE(at);
    Mpc pattern(gait);
    Watch watch(gait);
    Wish wish = forward(0.3);
    wish.velocity_m_s.y() = 0.05;
    wish.yaw_rate_rad_s = 0.1;
    for (int i = 0; i < 160 + at; ++i) {
      pattern.step(wish);
      watch.look(pattern.now());
    }
    const int steps = pattern.now().steps;
    const Eigen::Vector2d from = pattern.now().com.p_W_m;
    pattern.limit_iterations(1);
    bool told = false;
    for (int i = 0; i < 1400; ++i) {
      const NoMalloc guard;
      const PatternSample soon = pattern.ahead(1);
      pattern.forget();  // a start from the last solution may need no iteration
      pattern.step(wish);
      told = told || pattern.trouble().reason.find("stops") != std::string::npos;
      if (i > 100 && pattern.trouble().failed_solves > 0 && !pattern.trouble().reason.empty() &&
          pattern.now().gait != Gait::kStanding) {
        EXPECT_LT((pattern.now().com.p_W_m - soon.com.p_W_m).norm(), 1e-4) << i;
      }
      watch.look(pattern.now());
    }
    EXPECT_TRUE(told);
    EXPECT_EQ(pattern.now().gait, Gait::kStanding);
    EXPECT_LE(pattern.now().steps, steps + 3);
    EXPECT_LT(pattern.now().com.v_W.norm(), 1e-6);
    EXPECT_LT((pattern.now().com.p_W_m - from).norm(), 1.2);
    EXPECT_GT(pattern.trouble().failed_solves, 0) << "it would still walk";
    pattern.limit_iterations(0);
    for (int i = 0; i < 900; ++i) {
      pattern.step(i < 500 ? wish : stop());
      watch.look(pattern.now());
      ASSERT_EQ(pattern.trouble().failed_solves, 0) << i;
      if (i == 499) {
        EXPECT_EQ(pattern.now().gait, Gait::kWalking);
      }
    }
    expect_all_right(watch, kind, gait);
  }
}

TEST(LinearMpc, StopsWhenItHasNoPlansForLong) { stop_without_plans<LinearMpc>(); }

TEST(NonlinearMpc, StopsWhenItHasNoPlansForLong) { stop_without_plans<NonlinearMpc>(); }

TEST(LinearMpc, GoesOnWithTheLastPlanForAMoment) {
  LinearMpc pattern{GaitSettings{}};
  int failed = 0;
  for (int i = 0; i < 1500; ++i) {
    const bool without = i > 600 && i % 50 < 30;  // some programs need no iteration
    pattern.limit_iterations(without ? 1 : 0);
    if (without) pattern.forget();
    const PatternSample soon = pattern.ahead(1);
    pattern.step(forward(0.2));
    if (pattern.trouble().failed_solves == 0) continue;
    ++failed;
    EXPECT_NE(pattern.trouble().reason.find("the last plan goes on"), std::string::npos);
    ASSERT_LT((pattern.now().com.p_W_m - soon.com.p_W_m).norm(), 1e-12) << i;
    ASSERT_LT((pattern.now().zmp_W_m - soon.zmp_W_m).norm(), 1e-12) << i;
  }
  EXPECT_GT(failed, 50);
  EXPECT_EQ(pattern.now().gait, Gait::kWalking);
}

TEST(LinearMpc, StopsFromTheJerkThatItHad) {
  double jerks = 0.0, changes = 0.0;
  for (int at = 0; at < 320; at += 20) {
    LinearMpc pattern{GaitSettings{}};
    for (int i = 0; i < 480 + at; ++i) pattern.step(forward(0.3));
    pattern.limit_iterations(1);
    Eigen::Vector2d jerk = Eigen::Vector2d::Zero(), before = jerk;
    for (int i = 0; i < 400; ++i) {
      const Eigen::Vector2d a_W = pattern.now().com.a_W;
      pattern.forget();
      pattern.step(forward(0.3));
      before = std::exchange(jerk, (pattern.now().com.a_W - a_W) / kTick_s);
      if (pattern.trouble().reason.find("stops") != std::string::npos) break;
    }
    ASSERT_NE(pattern.trouble().reason.find("stops"), std::string::npos) << at;
    jerks += before.norm();
    changes += (jerk - before).norm();
  }
  EXPECT_GT(jerks, 16 * 1.0);
  EXPECT_LT(changes, 1.2 * jerks);  // from the jerk turned round: 1.6 times
}

TEST(LinearMpc, IsShiftedWhileItStops) {
  LinearMpc pattern{GaitSettings{}}, other{GaitSettings{}};
  const Eigen::Vector2d shift(0.02, -0.01);
  bool shifted = false;
  for (int i = 0; i < 2400; ++i) {
    for (LinearMpc* p : {&pattern, &other}) {
      if (i == 700) p->limit_iterations(1);
      if (i >= 700) p->forget();
      p->step(forward(0.3));
    }
    if (!shifted && other.trouble().reason.find("stops") != std::string::npos) {
      pattern.shift(shift);
      shifted = true;
    }
    if (!shifted) continue;
    for (const int ahead : {0, 50}) {
      const PatternSample a = pattern.ahead(ahead), b = other.ahead(ahead);
      ASSERT_LT((a.com.p_W_m - b.com.p_W_m - shift).norm(), 1e-9) << i;
      for (const Side side : robot::kSides) {
        const Eigen::Vector3d apart =
            a.foot[side].X_WS.translation() - b.foot[side].X_WS.translation();
        ASSERT_LT((apart.head<2>() - shift).norm(), 1e-9) << i;
      }
    }
  }
  EXPECT_TRUE(shifted);
}

}  // namespace
}  // namespace mimesis::walker
