#include "hw/sim/body/walk_judge.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace mimesis::hw::sim {
namespace {

using Eigen::Vector2d;

/// A robot that stands with its feet at ±0.1 m and 300 N on each.
BodyTruth standing(double time_s) {
  BodyTruth truth;
  truth.time_s = time_s;
  for (const robot::Side side : robot::kSides) {
    truth.X_WS[side] = Eigen::Translation3d(0.0, 0.1 * robot::sign(side), 0.0);
    truth.normal_n[side] = 300.0;
  }
  truth.zmp_W_m = {0.0, 0.0};
  truth.most_normal_n = 600.0;
  return truth;
}

/// A plan whose feet are where those of `standing` are.
PlannedGround planned(const Vector2d& zmp_W_m) {
  return {.zmp_W_m = zmp_W_m, .foot_W_m = {Vector2d(0.0, 0.1), Vector2d(0.0, -0.1)}};
}

TEST(WalkJudge, PeaksAreLowPassed) {
  WalkJudge judge;
  judge.tick(standing(0.0), {});
  BodyTruth blow = standing(0.005);
  blow.normal_n = {700.0, 300.0};
  blow.most_normal_n = 5000.0;
  blow.ankle_pitch_n_m = {0.0, -20.0};
  judge.tick(blow, {});
  for (int i = 2; i < 50; ++i) judge.tick(standing(0.005 * i), {});
  const double share = 1.0 - std::exp(-0.25);
  EXPECT_NEAR(judge.figures().normal_peak_n, 600.0 + share * 400.0, 1e-9);
  EXPECT_EQ(judge.figures().raw_normal_peak_n, 5000.0);
  EXPECT_EQ(judge.figures().ankle_pitch_peak_n_m, 20.0);
  EXPECT_NEAR(judge.figures().ankle_pitch_slow_peak_n_m, share * 20.0, 1e-9);
}

TEST(WalkJudge, ZmpErrorIsRmsOfPlannedTicks) {
  WalkJudge judge;
  judge.tick(standing(0.0), {});  // no plan: does not count
  judge.tick(standing(0.005), planned({0.03, 0.0}));
  judge.tick(standing(0.010), planned({0.0, -0.01}));
  EXPECT_NEAR(judge.figures().zmp_error_rms_m.x(), 0.03 / std::sqrt(2.0), 1e-12);
  EXPECT_NEAR(judge.figures().zmp_error_rms_m.y(), 0.01 / std::sqrt(2.0), 1e-12);
  BodyTruth flying = standing(0.015);
  flying.normal_n = {0.0, 0.0};
  judge.tick(flying, planned({1.0, 1.0}));  // no ground, no point on it
  EXPECT_LT(judge.figures().zmp_error_rms_m.x(), 0.03);
}

/// The robot has slipped and turned on its way, and its weight is on the left foot, which stands
/// 5 mm from its place beside the right one.
TEST(WalkJudge, ZmpErrorIsRelativeToTheFeet) {
  const double turn = 0.5 * std::numbers::pi;
  PlannedGround plan{.zmp_W_m = {0.97, 2.0}, .foot_W_m = {Vector2d(0.9, 2.0), Vector2d(1.1, 2.0)}};
  plan.foot_yaw_rad = {turn, turn};
  BodyTruth truth = standing(0.0);
  truth.X_WS[robot::kLeft].translation().y() += 0.005;
  truth.normal_n = {600.0, 0.0};
  truth.zmp_W_m = {0.02, 0.045};  // seen from the left foot 0.02 ahead, 0.06 right; planned 0, 0.07
  WalkJudge judge;
  judge.tick(truth, plan);
  EXPECT_NEAR(judge.figures().zmp_error_rms_m.x(), 0.01, 1e-12);
  EXPECT_NEAR(judge.figures().zmp_error_rms_m.y(), 0.02, 1e-12);
}

/// The plan stands turned and elsewhere: what counts is the foot as the other one sees it.
TEST(WalkJudge, StepErrorIsRelativeToTheOtherFoot) {
  WalkJudge judge;
  judge.tick(standing(0.0), {});
  JudgedStep step{.side = robot::kLeft,
                  .planned_W_m = {1.0 - 0.2, 2.0 + 0.25},
                  .planned_other_W_m = {1.0, 2.0},
                  .planned_other_yaw_rad = 0.5 * std::numbers::pi,
                  .wished_length_m = 0.24};
  judge.step(step);
  EXPECT_EQ(judge.figures().steps, 1);
  BodyTruth truth = standing(0.075);
  judge.tick(truth, {});
  EXPECT_EQ(judge.figures().step_error_max_m, 0.0);  // has not settled
  truth.time_s = 0.08;
  truth.X_WS[robot::kLeft].translation() << 0.253, 0.104, 0.0;
  judge.tick(truth, {});
  // seen from the right foot: planned 0.25 ahead, 0.2 to the left; real 0.253, 0.204
  EXPECT_NEAR(judge.figures().step_error_max_m, 0.005, 1e-9);
  EXPECT_NEAR(judge.figures().step_error_rms_m, 0.005, 1e-9);
  EXPECT_NEAR(judge.figures().step_length_error_max_m, 0.013, 1e-9);
  truth.X_WS[robot::kLeft].translation() << 9.0, 9.0,
      0.0;  // later motion of the foot does not count
  truth.time_s = 0.2;
  judge.tick(truth, {});
  EXPECT_NEAR(judge.figures().step_error_max_m, 0.005, 1e-9);
}

TEST(WalkJudge, NothingCountsAfterAFall) {
  WalkJudge judge;
  judge.tick(standing(0.0), {});
  BodyTruth fallen = standing(0.005);
  fallen.fell = true;
  fallen.how = "trunk tilted";
  judge.tick(fallen, {});
  BodyTruth later = standing(0.01);
  later.ankle_pitch_n_m = {99.0, 0.0};
  judge.tick(later, {});
  judge.step({});
  EXPECT_TRUE(judge.figures().fell);
  EXPECT_EQ(judge.figures().how, "trunk tilted");
  EXPECT_EQ(judge.figures().ankle_pitch_peak_n_m, 0.0);
  EXPECT_EQ(judge.figures().steps, 0);
}

}  // namespace
}  // namespace mimesis::hw::sim
