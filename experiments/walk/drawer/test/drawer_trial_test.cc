#include "experiments/walk/drawer/drawer_trial.h"

#include <gtest/gtest.h>

#include "experiments/walk/drawer/test/setting.h"

namespace mimesis::walk {
namespace {

TEST(DrawerTrial, TakesTheObjectAndWalksTheLengthsThatWereWished) {
  const DrawerResult result = run_drawer_trial(setting().spec());
  EXPECT_TRUE(result.taken) << result.refused;
  EXPECT_FALSE(result.walk.figures.fell);
  EXPECT_GT(result.handle_error_m, 0.0);
  EXPECT_LT(result.handle_error_m, 0.01);
  EXPECT_GT(result.reach_error_m, 0.0);
  EXPECT_LT(result.reach_error_m, 0.01);
  ASSERT_EQ(result.lengths.size(), 3U);
  EXPECT_LT(result.length_error_max_m(), 0.01);
  EXPECT_LT(result.walk.figures.normal_peak_n, 800.0);
  EXPECT_LT(result.walk.figures.ankle_pitch_slow_peak_n_m, 30.0);
}

TEST(DrawerTrial, StepsBackFromADrawerThatIsTooNear) {
  DrawerTrialSpec spec = setting().spec();
  spec.front_m = 0.25;
  const DrawerResult result = run_drawer_trial(spec);
  EXPECT_TRUE(result.taken) << result.refused;
  EXPECT_FALSE(result.walk.figures.fell);
  EXPECT_LT(result.reach_error_m, 0.01);
}

TEST(DrawerTrial, SaysWhyAGoalCannotBeReached) {
  DrawerTrialSpec spec = setting().spec();
  spec.front_m = 0.05;
  spec.time_limit_s = 3.0;
  const DrawerResult result = run_drawer_trial(spec);
  EXPECT_FALSE(result.taken);
  EXPECT_FALSE(result.refused.empty());
  EXPECT_FALSE(result.walk.figures.fell);
}

}  // namespace
}  // namespace mimesis::walk
