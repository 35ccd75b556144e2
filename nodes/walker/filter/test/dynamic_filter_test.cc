#include "nodes/walker/filter/dynamic_filter.h"

#include <gtest/gtest.h>

#include "common/error.h"
#include "common/robot/test/test_bipeds.h"
#include "common/testing/no_malloc.h"
#include "nodes/walker/testing/filtered_walk.h"
#include "nodes/walker/testing/swinging_arms.h"
#include "nodes/walker/filter/test/plain_walk.h"
#include "nodes/walker/pattern/mpc_pattern.h"

namespace mimesis::walker {
namespace {

TEST(DynamicFilter, OneIterationTakesAwayMostOfTheError) {
  const robot::Biped biped = robot::hrp2_like();
  for (const double arms : {0.0, 1.0}) {
    const FilteredWalk walk = filtered_walk(biped, 0.3, arms, {});
    const Eigen::Vector2d ratio = walk.rms_before_m().cwiseQuotient(walk.rms_after_m());
    EXPECT_GT(ratio.x(), 6.0);
    EXPECT_GT(ratio.y(), 3.0);
    EXPECT_GT(walk.rms_before_m().x(), 0.02);  // and there is one to take away
    EXPECT_GT(walk.rms_before_m().y(), 0.005);
    EXPECT_EQ(walk.unreachable, 0);
  }
}

TEST(DynamicFilter, ConvergesOverTheTicks) {
  const robot::Biped biped = robot::hrp2_like();
  const Eigen::Vector2d one = filtered_walk(biped, 0.3, 1.0, {}).rms_after_m(),
                        two = filtered_walk(biped, 0.3, 1.0, {.iterations = 2}).rms_after_m();
  EXPECT_LT(one.x(), 0.0014);
  EXPECT_LT(one.y(), 0.0008);
  EXPECT_LT((one - two).norm(), 3e-5);
}

TEST(DynamicFilter, LegsOnlyIsWorseWhenTheArmsMove) {
  const robot::Biped biped = robot::hrp2_like();
  const Eigen::Vector2d full = filtered_walk(biped, 0.3, 1.0, {}).rms_after_m(),
                        legs = filtered_walk(biped, 0.3, 1.0, {.legs_only = true}).rms_after_m();
  EXPECT_GT(legs.x(), 1.3 * full.x());
  EXPECT_GT(legs.y(), 1.3 * full.y());
  const Eigen::Vector2d still = filtered_walk(biped, 0.3, 0.0, {}, 6.0).rms_after_m(),
                        same =
                            filtered_walk(biped, 0.3, 0.0, {.legs_only = true}, 6.0).rms_after_m();
  EXPECT_EQ(still, same);
}

TEST(DynamicFilter, AnotherRobotIsFilteredAsWell) {
  const auto biped = robot::jvrc1();
  if (!biped) GTEST_SKIP() << "needs data/robots/jvrc1.urdf of the shared folder";
  const FilteredWalk walk = filtered_walk(*biped, 0.2, 0.0, {});
  EXPECT_GT(walk.rms_before_m().x(), 3.0 * walk.rms_after_m().x());
  EXPECT_GT(walk.rms_before_m().y(), 2.0 * walk.rms_after_m().y());
}

TEST(DynamicFilter, StandingRobotIsLeftAlone) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  DynamicFilter filter(biped, gait, {.iterations = 2});
  UpperBody upper;
  SwingingArms(biped, 0.0).at(0.0, upper);
  Wish still;
  still.walk = false;
  for (int i = 0; i < 200; ++i) {
    pattern.step(still);
    EXPECT_LT(filter.step(pattern, {&upper, 1}).p_W_m.norm(), 1e-4);
  }
}

TEST(DynamicFilter, OneUpperBodyIsTheSameAllAlong) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  DynamicFilter one(biped, gait, {}), all(biped, gait, {});
  std::vector<UpperBody> upper(20);
  SwingingArms(biped, 1.0).at(3.3, upper[0]);
  for (UpperBody& u : upper) u = upper[0];
  for (int i = 0; i < 300; ++i) {
    pattern.step(wish(0.2));
    const ComState a = one.step(pattern, {upper.data(), 1}), b = all.step(pattern, upper);
    ASSERT_EQ(a.p_W_m, b.p_W_m);
    ASSERT_EQ(a.a_W, b.a_W);
  }
}

TEST(DynamicFilter, LegsTooShortAreCountedAndTheShiftStaysSmall) {
  const robot::Biped biped = robot::hrp2_like();
  GaitSettings gait = gait_settings(biped);
  gait.com_height_m = 0.84;
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  DynamicFilter filter(biped, gait, {});
  UpperBody upper;
  SwingingArms(biped, 0.5).at(1.0, upper);
  int unreachable = 0;
  for (int i = 0; i < 1200; ++i) {
    pattern.step(wish(0.33));
    const ComState shift = filter.step(pattern, {&upper, 1});
    EXPECT_LT(shift.p_W_m.norm(), 0.05) << i;
    EXPECT_LT(shift.a_W.norm(), 3.0) << i;
    unreachable += filter.unreachable();
  }
  EXPECT_GT(unreachable, 100);
}

TEST(DynamicFilter, BeginsAnewAfterReset) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  DynamicFilter filter(biped, gait, {});
  UpperBody upper;
  SwingingArms(biped, 0.0).at(0.0, upper);
  std::array<std::vector<Eigen::Vector2d>, 2> shifts;
  for (auto& run : shifts) {
    LinearMpc pattern(gait);
    pattern.reset(stance(biped));
    filter.reset();
    for (int i = 0; i < 400; ++i) {
      pattern.step(wish(0.2));
      run.push_back(filter.step(pattern, {&upper, 1}).p_W_m);
    }
  }
  EXPECT_EQ(shifts[0], shifts[1]);
  EXPECT_GT(shifts[0].back().norm(), 1e-3);
}

TEST(DynamicFilter, DoesNotAllocate) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  LinearMpc pattern(gait);
  pattern.reset(stance(biped));
  DynamicFilter filter(biped, gait, {.iterations = 2, .legs_only = true});
  UpperBody upper;
  SwingingArms(biped, 0.0).at(0.0, upper);
  for (int i = 0; i < 300; ++i) pattern.step(wish(0.2));
  const testing::NoMalloc no_malloc;
  (void)filter.step(pattern, {&upper, 1});
}

TEST(DynamicFilter, RefusesSettingsThatMakeNoSense) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  for (const FilterSettings& wrong :
       {FilterSettings{.samples = 1}, FilterSettings{.window_s = 0.05},
        FilterSettings{.window_s = 1.7}, FilterSettings{.iterations = 0}}) {
    EXPECT_THROW(DynamicFilter(biped, gait, wrong), ConfigError);
  }
}

}  // namespace
}  // namespace mimesis::walker
