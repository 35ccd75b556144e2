#include "nodes/synthesizer/sequence/action_plan.h"

#include <gtest/gtest.h>

#include <limits>

namespace mimesis::synthesizer {
namespace {

ActionRanges trained() {
  static const ActionRanges ranges =
      ranges_of(generate_drawer_data(mocap::standard_body(), {}, {}).action);
  return ranges;
}

int count(const std::vector<PlannedAction>& plan, Action action) {
  int n = 0;
  for (const auto& a : plan) n += a.action == action ? 1 : 0;
  return n;
}

void expect_trained(const std::vector<PlannedAction>& plan) {
  const auto r = trained();
  for (const auto& a : plan) {
    if (a.action == kNormalStep) {
      EXPECT_TRUE(r.normal.holds(a.length_m)) << a.length_m;
    }
    if (a.action == kReachingStep) {
      EXPECT_TRUE(r.reaching.holds(a.length_m)) << a.length_m;
    }
    EXPECT_GT(a.duration_s, 0.8);
  }
  ASSERT_FALSE(plan.empty());
  EXPECT_EQ(plan.back().action, kStanding);
}

// [M18 3.4.2] in closed form, and 3.7: no additional steps between 2.34 and 2.94 m
/// Where the plan ends.
double final_distance(double distance_m, const std::vector<PlannedAction>& plan) {
  for (const PlannedAction& action : plan) distance_m -= action.length_m;
  return distance_m;
}

TEST(ActionPlan, ThreeActionsShareTheWayByGamma) {
  for (double d = 2.34; d <= 2.9401; d += 0.05) {
    const auto plan = plan_actions(d, trained());
    ASSERT_TRUE(plan.has_value()) << plan.error().reason;
    ASSERT_EQ(plan->size(), 3U) << d;
    EXPECT_NEAR((*plan)[0].length_m / 2.0, (d - 0.6) * 0.385, 1e-9);
    EXPECT_NEAR((*plan)[0].length_m / 2.0 + (*plan)[1].length_m, (d - 0.6) * (1.0 - 0.385), 1e-9);
    EXPECT_NEAR(final_distance(d, *plan), 0.6, 1e-9);
    expect_trained(*plan);
  }
}

TEST(ActionPlan, FarGoalsAddNormalSteps) {
  for (const auto& [distance, cycles] : {std::pair{3.84, 2}, {4.62, 2}, {5.3, 3}}) {
    const auto plan = plan_actions(distance, trained());
    ASSERT_TRUE(plan.has_value());
    EXPECT_EQ(count(*plan, kNormalStep), cycles) << distance;
    EXPECT_EQ(count(*plan, kReachingStep), 1) << distance;
    EXPECT_NEAR(final_distance(distance, *plan), 0.6, 1e-9);
    expect_trained(*plan);
  }
}

TEST(ActionPlan, NearGoalsAreReachedByShortSteps) {
  const auto plan = plan_actions(1.75, trained());
  ASSERT_TRUE(plan.has_value());
  EXPECT_EQ(count(*plan, kNormalStep), 0);
  EXPECT_EQ(count(*plan, kReachingStep), 2);
}

TEST(ActionPlan, EveryDistanceFromStandingOnHasAPlan) {
  for (double d = 0.60; d < 8.0; d += 0.01) {
    const auto plan = plan_actions(d, trained());
    ASSERT_TRUE(plan.has_value()) << d << ": " << plan.error().reason;
    expect_trained(*plan);
    const double end = final_distance(d, *plan);
    EXPECT_NEAR(end, 0.60, d < 0.80 ? 0.0851 : 1e-6) << d;
  }
}

TEST(ActionPlan, SaysWhyThereIsNone) {
  const auto near = plan_actions(0.3, trained());
  ASSERT_FALSE(near.has_value());
  EXPECT_NE(near.error().reason.find("too near"), std::string::npos) << near.error().reason;
  const auto far = plan_actions(40.0, trained());
  ASSERT_FALSE(far.has_value());
  EXPECT_NE(far.error().reason.find("farther"), std::string::npos) << far.error().reason;
  EXPECT_FALSE(plan_actions(std::numeric_limits<double>::quiet_NaN(), trained()).has_value());
}

// A jump of ±0.9 m at any time of any action: the new plan starts with the action under way, which
// can still become as long as it has to, and ends in front of the drawer.
TEST(ActionPlan, JumpsAreFollowedInEveryAction) {
  const auto r = trained();
  int replanned = 0, refused = 0;
  for (const Action action : {kNormalStep, kReachingStep})
    for (double share = 0.0; share < 1.0; share += 0.1)
      for (double jump = -0.9; jump <= 0.9; jump += 0.1) {
        const double planned = action == kNormalStep ? 1.57 : 0.47;
        const Underway now{action, planned, share * planned, share};
        const double distance =
            0.6 + planned * (1.0 - share) + (action == kNormalStep ? 0.47 : 0.0) + jump;
        const auto plan = replan_actions(now, distance, r);
        if (!plan) {
          ++refused;
          EXPECT_LT(jump, 0.0);  // farther is always possible
          continue;
        }
        ++replanned;
        expect_trained(*plan);
        EXPECT_EQ(plan->front().action, action);
        const double left = plan->front().length_m - now.walked_m, rest = 1.0 - share;
        const StepRange& range = action == kNormalStep ? r.normal : r.reaching;
        EXPECT_GE(left, rest * range.least_m - 1e-9);
        EXPECT_LE(left, rest * range.most_m + 1e-9);
        EXPECT_NEAR(final_distance(distance + now.walked_m, *plan), 0.6, 0.0851);
      }
  EXPECT_GT(replanned, 250);
  EXPECT_LT(refused, 130);
}

TEST(ActionPlan, AStandingWalkerStaysOrWalksOn) {
  const Underway standing{kStanding, 0.0, 0.0, 0.5};
  const auto stays = replan_actions(standing, 0.61, trained());
  ASSERT_TRUE(stays.has_value());
  EXPECT_EQ(stays->size(), 1U);
  const auto follows = replan_actions(standing, 1.1, trained());
  ASSERT_TRUE(follows.has_value());
  EXPECT_EQ(follows->front().action, kReachingStep);
  EXPECT_FALSE(replan_actions(standing, 0.3, trained()).has_value());
}

// The planned length is kept as long as the goal stays.
TEST(ActionPlan, WithoutAJumpThePlanStays) {
  const auto plan = plan_actions(2.7, trained());
  ASSERT_TRUE(plan.has_value());
  const double length = plan->front().length_m;
  const auto again =
      replan_actions({kNormalStep, length, 0.4 * length, 0.4}, 2.7 - 0.4 * length, trained());
  ASSERT_TRUE(again.has_value());
  ASSERT_EQ(again->size(), 3U);
  EXPECT_NEAR(final_distance(2.7, *again), 0.6, 1e-6);
}

TEST(ActionPlan, NoTrialsNoRanges) {
  EXPECT_THROW(ranges_of(std::array<mocap::Trials, kActions>{}), ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
