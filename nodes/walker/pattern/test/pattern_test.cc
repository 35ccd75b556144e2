#include <gtest/gtest.h>

#include "common/error.h"
#include "common/testing/no_malloc.h"
#include "nodes/walker/pattern/mpc_pattern.h"
#include "nodes/walker/pattern/preview_pattern.h"
#include "nodes/walker/pattern/test/patterns.h"

namespace mimesis::walker {
namespace {

using namespace testing;
using mimesis::testing::NoMalloc;

TEST_P(Patterns, StandInTheMiddleAfterReset) {
  auto pattern = make();
  pattern->reset({Footprint{kLeft, {1.0, 2.1}, 0.1}, Footprint{kRight, {1.02, 1.9}, 0.1}});
  run(*pattern, stop(), 100);
  const PatternSample& s = pattern->now();
  EXPECT_EQ(s.gait, Gait::kStanding);
  EXPECT_LT((s.com.p_W_m - Eigen::Vector2d(1.01, 2.0)).norm(), 1e-12);
  EXPECT_DOUBLE_EQ(s.yaw_rad, 0.1);
  EXPECT_TRUE(s.contact[kLeft] && s.contact[kRight]);
}

TEST_P(Patterns, StartWalkStopInTime) {
  auto pattern = make();
  int lifted = -1, landed = -1;
  for (int i = 1; i <= 400 && landed < 0; ++i) {
    pattern->step(forward(0.2));
    if (!pattern->now().contact[kLeft] && lifted < 0) lifted = i;
    if (lifted > 0 && pattern->now().contact[kLeft]) landed = i;
  }
  EXPECT_EQ(lifted, 160 + 20 + 1);  // the first tick in the air
  EXPECT_EQ(landed, 160 + 160);
  EXPECT_EQ(pattern->now().gait, Gait::kWalking);
  EXPECT_EQ(pattern->now().steps, 1);
  run(*pattern, forward(0.2), 5 * 160 + 50);
  EXPECT_EQ(pattern->now().steps, 6);
  EXPECT_NEAR(pattern->now().to_landing_s, 0.55, 1e-9);
  run(*pattern, stop(), 110);
  EXPECT_EQ(pattern->now().gait, Gait::kStopping);
  run(*pattern, stop(), 160);
  EXPECT_EQ(pattern->now().steps, 8) << "two more landings";
  run(*pattern, stop(), 600);
  const PatternSample& s = pattern->now();
  EXPECT_EQ(s.gait, Gait::kStanding);
  EXPECT_EQ(s.steps, 8);
  const Eigen::Vector3d left = s.foot[kLeft].X_WS.translation(),
                        right = s.foot[kRight].X_WS.translation();
  EXPECT_NEAR(left.x(), right.x(), 1e-3);
  EXPECT_NEAR(left.y() - right.y(), 0.19, 1e-3);
  EXPECT_LT((s.com.p_W_m - (left + right).head<2>() / 2.0).norm(), 1e-3);
  EXPECT_LT(s.com.v_W.norm(), 1e-3);
}

TEST_P(Patterns, WalkAsFastAsIsWished) {
  struct Case {
    double forward, left, turn;
  };
  for (const Case c : {Case{0.1, 0, 0},
                       {0.2, 0, 0},
                       {0.35, 0, 0},
                       {-0.2, 0, 0},
                       {0, 0.1, 0},
                       {0, -0.1, 0},
                       {0.15, 0.05, 0},
                       {0.2, 0, 0.15},
                       {0, 0, 0.2},
                       {0, 0, -0.2}}) {
    auto pattern = make();
    Wish wish;
    wish.velocity_m_s = {c.forward, c.left};
    wish.yaw_rate_rad_s = c.turn;
    run(*pattern, wish, 160 * 9);
    Eigen::Vector2d way = Eigen::Vector2d::Zero();
    const double yaw = pattern->now().yaw_rad;
    constexpr int kSteps = 8;  // pairs of them: a walk aside limps
    for (int i = 0; i < 160 * kSteps; ++i) {
      pattern->step(wish);
      EXPECT_FALSE(pattern->trouble().clipped);
      const PatternSample& s = pattern->now();
      way += rotation(-s.yaw_rad) * s.com.v_W * kTick_s;
    }
    const double seconds = kSteps * 0.8;
    const double speed = std::hypot(c.forward, c.left);
    EXPECT_LT((way / seconds - Eigen::Vector2d(c.forward, c.left)).norm(),
              speed > 0.0 ? 0.02 * speed : 0.004)
        << c.forward << ' ' << c.left << ' ' << c.turn << ": " << (way / seconds).transpose();
    EXPECT_NEAR((pattern->now().yaw_rad - yaw) / seconds, c.turn, 0.02 * std::abs(c.turn) + 1e-9);
  }
}

TEST_P(Patterns, HoldEveryStepOfAStraightWalkToTheWish) {
  auto pattern = make();
  run(*pattern, forward(0.25), 160 * 6);
  for (int step = 0; step < 6; ++step) {
    const double x = pattern->now().com.p_W_m.x();
    run(*pattern, forward(0.25), 160);
    EXPECT_NEAR((pattern->now().com.p_W_m.x() - x) / 0.8, 0.25, 0.02 * 0.25);
  }
}

TEST_P(Patterns, PreviewWhatTheyThenDo) {
  auto pattern = make();
  run(*pattern, forward(0.25), 160 * 6 + 37);
  for (const int ahead : {0, 1, 20, 60, 140, 200, 319}) {
    const PatternSample preview = pattern->ahead(ahead);
    auto later = make();
    run(*later, forward(0.25), 160 * 6 + 37 + ahead);
    const PatternSample& s = later->now();
    const double tolerance = ahead == 0 ? 0.0
                                        : (ahead <= 140   ? 1.0
                                           : ahead <= 200 ? 5.0
                                                          : 12.5) *
                                              GetParam().preview_m;
    EXPECT_LE((preview.com.p_W_m - s.com.p_W_m).norm(), tolerance) << ahead;
    EXPECT_LE((preview.zmp_W_m - s.zmp_W_m).norm(), 5.0 * tolerance) << ahead;
    for (const Side side : robot::kSides) {
      EXPECT_LE((preview.foot[side].X_WS.translation() - s.foot[side].X_WS.translation()).norm(),
                5.0 * tolerance)
          << ahead;
      EXPECT_EQ(preview.contact[side], s.contact[side]) << ahead;
    }
    EXPECT_EQ(preview.swing, s.swing);
    EXPECT_EQ(preview.gait, s.gait);
    EXPECT_EQ(preview.steps, s.steps);
    EXPECT_NEAR(preview.to_landing_s, s.to_landing_s, 1e-12);
  }
}

TEST_P(Patterns, PreviewIsNowAtEveryTick) {
  auto pattern = make();
  for (int i = 0; i < 1500; ++i) {
    pattern->step(i < 900 ? forward(0.3) : stop());
    const PatternSample& now = pattern->now();
    const PatternSample preview = pattern->ahead(0);
    ASSERT_EQ(preview.com.p_W_m, now.com.p_W_m);
    ASSERT_EQ(preview.zmp_W_m, now.zmp_W_m);
    ASSERT_EQ(preview.foot[kLeft].X_WS.translation(), now.foot[kLeft].X_WS.translation());
    ASSERT_EQ(preview.left_share, now.left_share);
  }
}

TEST_P(Patterns, ShiftAll) {
  auto pattern = make(), other = make();
  const Eigen::Vector2d shift(0.02, -0.01);
  run(*pattern, forward(0.2), 160 * 4 + 71);
  run(*other, forward(0.2), 160 * 4 + 71);
  pattern->shift(shift);
  for (int i = 0; i < 700; ++i) {
    const PatternSample &a = pattern->now(), &b = other->now();
    ASSERT_LT((a.com.p_W_m - b.com.p_W_m - shift).norm(), 1e-6) << i;
    ASSERT_LT((a.zmp_W_m - b.zmp_W_m - shift).norm(), 1e-5);
    for (const Side side : robot::kSides)
      ASSERT_LT(
          ((a.foot[side].X_WS.translation() - b.foot[side].X_WS.translation()).head<2>() - shift)
              .norm(),
          1e-6);
    const PatternSample c = pattern->ahead(100), d = other->ahead(100);
    ASSERT_LT((c.com.p_W_m - d.com.p_W_m - shift).norm(), 1e-5);
    pattern->step(forward(0.2));
    other->step(forward(0.2));
  }
}

TEST_P(Patterns, WalkTheSameFarFromTheOriginAndTurned) {
  auto pattern = make(), far = make();
  const double yaw = 2.5;
  const Eigen::Vector2d origin(2000.0, -3000.0);
  std::array<Footprint, 2> feet = {Footprint{kLeft, {0.0, 0.095}, yaw},
                                   Footprint{kRight, {0.0, -0.095}, yaw}};
  for (Footprint& foot : feet) foot.p_W_m = origin + rotation(yaw) * foot.p_W_m;
  far->reset(feet);
  Wish wish = forward(0.2);
  wish.yaw_rate_rad_s = 0.1;
  for (int i = 0; i < 2000; ++i) {
    pattern->step(wish);
    far->step(wish);
    ASSERT_LT((rotation(-yaw) * (far->now().com.p_W_m - origin) - pattern->now().com.p_W_m).norm(),
              1e-5)
        << i;
  }
}

TEST_P(Patterns, DoNotAllocate) {
  auto pattern = make();
  Wish wish = forward(0.3);
  for (int i = 0; i < 2000; ++i) {
    if (i == 900) wish = forward(kNan);
    if (i == 1300) wish = forward(0.9);
    const NoMalloc guard;
    pattern->step(wish);
    (void)pattern->ahead(i % kPreviewTicks);
  }
}

TEST_P(Patterns, AreTheSameBitsEveryTime) {
  auto a = make(), b = make();
  run(*b, forward(0.1), 777);
  b->reset({Footprint{kLeft, {0.0, 0.095}, 0.0}, Footprint{kRight, {0.0, -0.095}, 0.0}});
  for (int i = 0; i < 1000; ++i) {
    a->step(forward(0.3));
    b->step(forward(0.3));
    ASSERT_EQ(a->now().com.p_W_m, b->now().com.p_W_m) << i;
    ASSERT_EQ(a->now().zmp_W_m, b->now().zmp_W_m) << i;
  }
}

TEST_P(Patterns, RefuseSettingsThatMakeNoSense) {
  GaitSettings gait;
  gait.step_s = 0.83;
  EXPECT_THROW((void)make(gait), ConfigError);
  gait = {};
  gait.com_height_m = kNan;
  EXPECT_THROW((void)make(gait), ConfigError);
  gait = {};
  gait.narrowest_step_m = 0.3;
  EXPECT_THROW((void)make(gait), ConfigError);
}

INSTANTIATE_TEST_SUITE_P(
    All, Patterns,
    ::testing::Values(
        Kind{"linear", [](const GaitSettings& g) { return std::make_unique<LinearMpc>(g); }, 0.005,
             0.002, true},
        Kind{"nonlinear", [](const GaitSettings& g) { return std::make_unique<NonlinearMpc>(g); },
             0.005, 0.002, true},
        Kind{"preview", [](const GaitSettings& g) { return std::make_unique<PreviewPattern>(g); },
             0.03, 0.002, false}),
    [](const auto& kind) { return kind.param.name; });

}  // namespace
}  // namespace mimesis::walker
