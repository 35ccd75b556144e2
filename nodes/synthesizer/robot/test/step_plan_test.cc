#include "nodes/synthesizer/robot/step_plan.h"

#include <gtest/gtest.h>

namespace mimesis::synthesizer {
namespace {

constexpr double kComfort = 0.51;

StepPlan plan_for(const FeetAlongWay& feet, double front_m) {
  const auto plan = plan_steps(feet, front_m, kComfort);
  EXPECT_TRUE(plan.has_value()) << "front at " << front_m;
  return plan.value_or(StepPlan{});
}

/// Steps alternate, are no longer than they may be, and end with the feet side by side at the final
/// distance.
void expect_sound(const FeetAlongWay& feet, double front_m, const StepPlan& plan) {
  double support = feet.support_m, other = feet.other_m;
  mocap::Side side = feet.swing;
  for (const PlannedStep& step : plan.steps) {
    EXPECT_EQ(step.side, side);
    EXPECT_LE(step.x_m - support, 0.28 + 1e-9) << "front at " << front_m;
    EXPECT_GE(step.x_m - support, -1e-9);
    other = support;
    support = step.x_m;
    side = side == mocap::kLeft ? mocap::kRight : mocap::kLeft;
  }
  if (!plan.steps.empty()) {
    EXPECT_EQ(plan.steps.back().side, mocap::kLeft);
    EXPECT_EQ(plan.steps.back().action, kReachingStep);
    EXPECT_NEAR(support, other, 1e-9);
  }
  const double final_m = front_m - 0.5 * (support + other);
  EXPECT_NEAR(final_m, plan.final_distance_m, 1e-9);
  EXPECT_GE(final_m, kComfort - 0.08 - 1e-6);
  EXPECT_LE(final_m, kComfort + 0.03 + 1e-6);
}

TEST(StepPlan, ReachesEveryDistanceFromAStand) {
  for (int k = 0; k <= 500; ++k) {
    const double front = 0.465 + 0.01 * k;
    expect_sound({}, front, plan_for({}, front));
  }
}

TEST(StepPlan, ReachesEveryDistanceFromFullStride) {
  FeetAlongWay feet{.support_m = 0.3, .other_m = 0.035, .stands = false};
  for (int k = 0; k <= 400; ++k) {
    const double front = 0.3 + kComfort + 0.04 + 0.01 * k;
    expect_sound(feet, front, plan_for(feet, front));
  }
  feet.swing = mocap::kLeft;
  for (const Action action : {kNormalStep, kReachingStep}) {
    feet.action = action;
    for (int k = 0; k <= 400; ++k) {
      const double front = 0.3 + kComfort + 0.01 * k;
      expect_sound(feet, front, plan_for(feet, front));
    }
  }
}

TEST(StepPlan, TakesTheComfortableLengths) {
  // two actions 1 from a stand, the first three quarters of it, and an action 2
  const double way = 2.0 * 0.533 + (0.261 - 0.25 * 0.533);
  const StepPlan plan = plan_for({}, way + kComfort);
  ASSERT_EQ(plan.steps.size(), 6U);
  EXPECT_NEAR(plan.steps[0].x_m, 0.2665, 1e-6);
  EXPECT_NEAR(plan.steps[3].x_m, 1.066, 1e-6);
  EXPECT_NEAR(plan.final_distance_m, kComfort, 1e-6);
  EXPECT_NEAR(plan.cost, 0.0, 1e-6);
}

TEST(StepPlan, StandsWhereItIsIfThatIsNearEnough) {
  EXPECT_TRUE(plan_for({}, kComfort + 0.02).steps.empty());
  EXPECT_TRUE(plan_for({}, kComfort - 0.075).steps.empty());
  for (const double farther : {0.035, 0.05, 0.06}) {
    const StepPlan plan = plan_for({}, kComfort + farther);
    ASSERT_EQ(plan.steps.size(), 2U) << farther;  // arms would be too short
    EXPECT_GE(plan.steps[0].x_m, 0.03);
  }
  const FeetAlongWay stride{.support_m = 0.0, .other_m = -0.26, .stands = false};
  EXPECT_FALSE(plan_for(stride, kComfort + 0.04).steps.empty());  // feet apart
}

TEST(StepPlan, GoesOnWithTheActionUnderWayIfItCan) {
  const FeetAlongWay reaching{.support_m = 0.2,
                              .other_m = 0.0,
                              .swing = mocap::kLeft,
                              .action = kReachingStep,
                              .stands = false};
  const StepPlan closes = plan_for(reaching, 0.2 + kComfort);
  ASSERT_EQ(closes.steps.size(), 1U);
  EXPECT_NEAR(closes.steps[0].x_m, 0.2, 1e-9);
  FeetAlongWay normal = reaching;
  normal.action = kNormalStep;
  const StepPlan strides = plan_for(normal, 0.2 + 0.2665 + 0.1278 + kComfort);
  ASSERT_EQ(strides.steps.size(), 3U);
  EXPECT_EQ(strides.steps[0].action, kNormalStep);
}

TEST(StepPlan, ARightFootBeginsAnActionWhateverWasUnderWay) {
  FeetAlongWay feet{.support_m = 0.2, .other_m = 0.0, .swing = mocap::kRight, .stands = false};
  for (const double front : {1.2, 1.7, 2.3}) {
    feet.action = kNormalStep;
    const StepPlan normal = plan_for(feet, front);
    feet.action = kReachingStep;
    const StepPlan reaching = plan_for(feet, front);
    EXPECT_EQ(normal.cost, reaching.cost) << front;
    EXPECT_TRUE(normal.steps == reaching.steps) << front;
  }
}

TEST(StepPlan, SaysWhyNot) {
  EXPECT_NE(plan_steps({}, 0.4, kComfort).error().reason.find("too near"), std::string::npos);
  EXPECT_NE(plan_steps({}, 12.0, kComfort).error().reason.find("farther"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::synthesizer
