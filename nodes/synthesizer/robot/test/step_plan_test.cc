#include "nodes/synthesizer/robot/step_plan.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

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
    EXPECT_GE(step.x_m - support, -0.15 - 1e-9);
    if (step.side == mocap::kLeft || step.action == kNormalStep) {
      EXPECT_GE(step.x_m - support, -1e-9);  // only the right foot leads back; the left one closes
    }
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

TEST(StepPlan, StepsBackFromADrawerThatIsTooNearAlone) {
  EXPECT_TRUE(plan_for({}, kComfort - 0.08).steps.empty());
  // cheapest end: (x/0.075 + 1)² + ((0.41 − x − 0.51)/0.03)² of the step x and the final distance
  const StepPlan back = plan_for({}, kComfort - 0.10);
  ASSERT_EQ(back.steps.size(), 2U);
  const double x =
      -(1.0 / 0.075 + 0.10 / (0.03 * 0.03)) / (1.0 / (0.075 * 0.075) + 1.0 / (0.03 * 0.03));
  EXPECT_NEAR(back.steps[0].x_m, x, 1e-6);
  EXPECT_NEAR(back.steps[1].x_m, x, 1e-6);
  EXPECT_EQ(plan_for({}, kComfort - 0.28).steps.size(), 4U);
}

TEST(StepPlan, AFootInTheAirIsPutDownBeforeTheRobotStepsBack) {
  FeetAlongWay feet{.support_m = 0.3, .other_m = 0.1, .stands = false};
  const double front = 0.3 + kComfort - 0.12;
  const StepPlan closes = plan_for(feet, front);
  ASSERT_EQ(closes.steps.size(), 4U);
  for (const std::size_t i : {0U, 1U}) EXPECT_EQ(closes.steps[i].x_m, 0.3);
  EXPECT_LT(closes.steps[2].x_m, 0.3 - 0.03);
  feet.may_step_back = true;
  ASSERT_EQ(plan_for(feet, front).steps.size(), 2U);
  feet.swing = mocap::kLeft;
  const StepPlan left = plan_for(feet, front);
  ASSERT_EQ(left.steps.size(), 3U);
  EXPECT_EQ(left.steps[0].x_m, 0.3);
  EXPECT_EQ(left.steps[1].side, mocap::kRight);
  // no step back where closing is enough
  feet.swing = mocap::kRight;
  feet.may_step_back = false;
  EXPECT_EQ(plan_for(feet, 0.3 + kComfort - 0.07).steps.size(), 2U);
}

TEST(StepPlan, DrawnPlansAreSoundAndRefusedOnlyTooNear) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> share(0.0, 1.0);
  int refused = 0, back = 0;
  for (int i = 0; i < 20000; ++i) {
    FeetAlongWay feet{.support_m = std::lerp(-1.0, 1.0, share(random))};
    feet.stands = share(random) < 0.3;
    feet.swing = !feet.stands && share(random) < 0.5 ? mocap::kLeft : mocap::kRight;
    feet.other_m = feet.support_m - (feet.stands ? 0.0 : std::lerp(-0.15, 0.28, share(random)));
    feet.action = share(random) < 0.5 ? kNormalStep : kReachingStep;
    feet.may_step_back = !feet.stands && share(random) < 0.3;
    const double front = feet.support_m + std::lerp(-0.1, 3.0, share(random) * share(random));
    const auto plan = plan_steps(feet, front, kComfort);
    // nearest stand, and two steps back to it
    const bool too_near = front - feet.support_m < kComfort - 0.08 - 2.0 * 0.15 - 1e-6;
    ASSERT_EQ(plan.has_value(), !too_near) << front - feet.support_m << " " << feet.swing;
    if (!plan) {
      ++refused;
      EXPECT_NE(plan.error().reason.find("too near"), std::string::npos);
      continue;
    }
    expect_sound(feet, front, *plan);
    const bool leads_back = !plan->steps.empty() && plan->steps.back().x_m < feet.support_m - 1e-9;
    back += leads_back;
    if (!leads_back) continue;
    EXPECT_LT(front - feet.support_m, kComfort - 0.08);
    // the step under way is not turned around
    const bool may = feet.stands || (feet.may_step_back && feet.swing == mocap::kRight);
    EXPECT_TRUE(may || plan->steps[0].x_m == feet.support_m);
  }
  EXPECT_GT(refused, 1000);
  EXPECT_GT(back, 1000);
}

TEST(StepPlan, SaysWhyNot) {
  EXPECT_NE(plan_steps({}, 0.12, kComfort).error().reason.find("too near"), std::string::npos);
  EXPECT_NE(plan_steps({}, 12.0, kComfort).error().reason.find("farther"), std::string::npos);
}

}  // namespace
}  // namespace mimesis::synthesizer
