#include "nodes/walker/pattern/swing_height.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "nodes/walker/pattern/steps.h"

namespace mimesis::walker {
namespace {

constexpr int kSteps = 2000;
constexpr double kStep = 1.0 / kSteps;

TEST(SwingHeight, BeginsAndEndsAtRestOnTheGround) {
  for (const double u : {-0.1, 0.0, 1.0, 1.1}) {
    EXPECT_EQ(swing_height(u).z, 0.0) << u;
    EXPECT_EQ(swing_height(u).dz, 0.0) << u;
  }
  EXPECT_EQ(swing_height(0.0).ddz, 0.0);
}

TEST(SwingHeight, RatesAreThoseOfTheHeight) {
  for (int i = 1; i < kSteps; ++i) {
    const double u = i * kStep, d = 1e-5;
    const SwingHeight before = swing_height(u - d), now = swing_height(u),
                      after = swing_height(u + d);
    EXPECT_NEAR((after.z - before.z) / (2.0 * d), now.dz, 1e-4) << u;
    EXPECT_NEAR((after.dz - before.dz) / (2.0 * d), now.ddz, 2e-2) << u;
  }
}

TEST(SwingHeight, GoesUpOnceAndDownOnceAndReachesItsHeight) {
  double highest = 0.0;
  int turns = 0;
  for (int i = 1; i < kSteps; ++i) {
    const SwingHeight now = swing_height(i * kStep);
    highest = std::max(highest, now.z);
    EXPECT_GT(now.z, 0.0) << i;
    turns += (now.dz > 0.0) != (swing_height((i + 1) * kStep).dz > 0.0);
  }
  EXPECT_NEAR(highest, 1.0, 1e-4);
  EXPECT_EQ(turns, 1);
}

TEST(SwingHeight, IsSlowerThanAPlainSwingWhereItMayTouchEarly) {
  int looked_at = 0;
  for (int i = kSteps / 2; i < kSteps; ++i) {
    const double u = i * kStep, w = u * (1.0 - u), plain = 64.0 * w * w * w;
    if (plain < 0.04 || plain > 0.1) continue;
    const double plain_speed = 64.0 * 3.0 * w * w * (2.0 * u - 1.0);
    for (int j = kSteps / 2; j < kSteps; ++j) {  // where the glide is as high
      const SwingHeight now = swing_height(j * kStep);
      if (std::abs(now.z - plain) > 2e-4) continue;
      EXPECT_LT(-now.dz, 0.61 * plain_speed) << plain;
      ++looked_at;
    }
  }
  EXPECT_GT(looked_at, 20);
}

TEST(SwingHeight, FootIsAtItsPlaceWhileItGlides) {
  const GaitSettings gait;
  Steps steps(gait, Steps::Change::kAtOnce);
  steps.decide(true, kLeft, true);
  Footprint landing = steps.ground()[kLeft];
  landing.p_W_m.x() += 0.4;
  const double swing_s = gait.step_s - gait.double_support_s;
  int gliding = 0;
  for (int tick = 0; tick < 400 && steps.swing() == kLeft; ++tick) {
    steps.plan(0, landing);
    PatternSample sample;
    steps.describe(sample);
    const double left_s = sample.to_landing_s,
                 to_go_m = landing.p_W_m.x() - sample.foot[kLeft].X_WS.translation().x();
    if (steps.phase() == Steps::Phase::kStep && left_s < 0.95 * swing_s / 7.0) {
      EXPECT_NEAR(to_go_m, 0.0, 1e-12) << left_s;
      ++gliding;
    } else if (left_s > 1.3 * swing_s / 7.0) {
      EXPECT_GT(to_go_m, 1e-4) << left_s;
    }
    steps.advance(1);
  }
  EXPECT_GT(gliding, 10);
}

}  // namespace
}  // namespace mimesis::walker
