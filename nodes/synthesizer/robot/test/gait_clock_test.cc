#include <gtest/gtest.h>

#include <numbers>
#include <utility>

#include "common/math/circle.h"
#include "nodes/synthesizer/robot/robot_feedback.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kClockDt = 0.005, kStep = 0.8;

RobotFeedback stepping(mocap::Side swing, double to_landing_s) {
  RobotFeedback f;
  f.gait = RobotGait::walking;
  f.swing = swing;
  f.to_landing_s = to_landing_s;
  return f;
}

TEST(GaitClock, RunsByItselfAndEndsWithAStep) {
  GaitClock clock(kStep, kClockDt);
  clock.step(nullptr, false);
  EXPECT_FALSE(clock.moves());
  EXPECT_EQ(clock.rate_rad_s(), 0.0);
  for (int i = 0; i < 100; ++i) clock.step(nullptr, true);  // 0.5 s
  EXPECT_NEAR(clock.phase_rad(), std::numbers::pi * 0.5 / kStep, 1e-9);
  EXPECT_NEAR(clock.to_landing_s(), 0.3, 1e-9);
  EXPECT_EQ(clock.swing(), mocap::kRight);
  int steps = 0;
  mocap::Side swing = clock.swing();
  for (int i = 0; i < 400; ++i) {
    clock.step(nullptr, false);
    if (std::exchange(swing, clock.swing()) != clock.swing()) ++steps;
  }
  EXPECT_EQ(steps, 1);
  EXPECT_FALSE(clock.moves());
  EXPECT_NEAR(clock.phase_rad(), std::numbers::pi, 0.03);
}

TEST(GaitClock, FollowsTheFeetOfTheRobot) {
  GaitClock clock(kStep, kClockDt);
  double before = 0.0, t = 0.0;
  int left = 0, right = 0;
  mocap::Side swung = clock.swing();
  for (int i = 0; i < 1600; ++i, t += kClockDt) {  // ten steps, the left foot first
    const double in_step = std::fmod(t, kStep);
    const bool is_left = static_cast<int>(t / kStep) % 2 == 0;
    const RobotFeedback f = stepping(is_left ? mocap::kLeft : mocap::kRight, kStep - in_step);
    before = clock.phase_rad();
    clock.step(&f, true);
    const mocap::Side swing = clock.swing();
    left += swing == mocap::kRight && swung == mocap::kLeft ? 1 : 0;
    right += swing == mocap::kLeft && swung == mocap::kRight ? 1 : 0;
    swung = swing;
    EXPECT_GE(math::wrap_pi(clock.phase_rad() - before), 0.0);  // never backwards
    if (t > 2.0) {
      const double robot = (is_left ? std::numbers::pi : 0.0) + std::numbers::pi * in_step / kStep;
      ASSERT_LT(std::abs(math::wrap_pi(clock.phase_rad() - robot)), 0.05) << "at " << t;
    }
  }
  EXPECT_NEAR(left, 5, 1);
  EXPECT_NEAR(right, 5, 1);
}

TEST(GaitClock, WaitsWhileTheWeightIsShifted) {
  GaitClock clock(kStep, kClockDt);
  RobotFeedback f = stepping(mocap::kRight, 1.5);
  f.gait = RobotGait::starting;
  for (; f.to_landing_s > kStep; f.to_landing_s -= kClockDt) clock.step(&f, true);
  EXPECT_TRUE(clock.moves());
  EXPECT_NEAR(clock.phase_rad(), 0.0, 1e-6);
}

TEST(GaitClock, StandsWithTheRobot) {
  GaitClock clock(kStep, kClockDt);
  const RobotFeedback standing;
  for (int i = 0; i < 200; ++i) clock.step(&standing, true);
  EXPECT_EQ(clock.phase_rad(), 0.0);
  EXPECT_FALSE(clock.moves());
}

}  // namespace
}  // namespace mimesis::synthesizer
