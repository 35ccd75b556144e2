#include "experiments/motion/grafted_raises.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "common/error.h"
#include "common/shared_data.h"
#include "common/testing/refusal.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd ramp_movement() {
  MatrixXd movement(2, 11);
  for (Index i = 0; i < 11; ++i) movement.col(i) << 0.1 * static_cast<double>(i), 5.0;
  return movement;
}

TEST(Graft, HoldsMovesAndHolds) {
  MatrixXd trial = MatrixXd::Constant(4, 100, -7.0);
  graft(trial, ramp_movement(), {3, 1}, {.onset = 0.2, .span = 0.5});
  EXPECT_EQ(trial(3, 0), 0.0);
  EXPECT_NEAR(trial(3, 20), 0.0, 1e-12);
  EXPECT_NEAR(trial(3, 21), 0.02, 1e-12);  // 1 of 50 samples
  EXPECT_NEAR(trial(3, 45), 0.5, 1e-12);
  EXPECT_NEAR(trial(3, 69), 0.98, 1e-12);
  EXPECT_NEAR(trial(3, 70), 1.0, 1e-12);
  EXPECT_EQ(trial(3, 99), 1.0);
}

TEST(Graft, TouchesItsRowsOnly) {
  MatrixXd trial = MatrixXd::Constant(4, 100, -7.0);
  graft(trial, ramp_movement(), {3, 1}, {.onset = 0.0, .span = 1.0});
  EXPECT_TRUE((trial.row(0).array() == -7.0).all());
  EXPECT_TRUE((trial.row(2).array() == -7.0).all());
  EXPECT_TRUE((trial.row(1).array() == 5.0).all());
}

TEST(Graft, RefusesWhatDoesNotFit) {
  MatrixXd trial = MatrixXd::Zero(4, 100);
  const MatrixXd movement = ramp_movement();
  EXPECT_THROW(graft(trial, movement, {1}, {}), ConfigError);
  EXPECT_THROW(graft(trial, movement, {1, 4}, {}), ConfigError);
  EXPECT_THROW(graft(trial, movement, {-1, 2}, {}), ConfigError);
  EXPECT_THROW(graft(trial, movement.leftCols(1), {1, 2}, {}), ConfigError);
  EXPECT_THROW(graft(trial, movement, {1, 2}, {.onset = 0.6, .span = 0.5}), ConfigError);
  EXPECT_THROW(graft(trial, movement, {1, 2}, {.onset = -0.1, .span = 0.5}), ConfigError);
  EXPECT_THROW(graft(trial, movement, {1, 2}, {.onset = 0.1, .span = 0.0}), ConfigError);
  EXPECT_THROW(graft(trial, movement, {1, 2}, {.onset = std::nan(""), .span = 0.5}), ConfigError);
}

TEST(Graft, ArmRowsAreThoseOfTheSide) {
  const auto left = arm_rows(mocap::kLeft), right = arm_rows(mocap::kRight);
  ASSERT_EQ(left.size(), 9U);
  EXPECT_EQ(mocap::body_row_name(static_cast<int>(left.front())), "lsho.x");
  EXPECT_EQ(mocap::body_row_name(static_cast<int>(left.back())), "lwri.z");
  EXPECT_EQ(mocap::body_row_name(static_cast<int>(right.front())), "rsho.x");
  EXPECT_EQ(mocap::body_row_name(static_cast<int>(right.back())), "rwri.z");
}

TEST(Graft, FindsTheHighestHand) {
  mocap::BodyClip clip;
  clip.body = mocap::standard_body();
  clip.rate_hz = 30.0;
  clip.angles_rad = MatrixXd::Zero(mocap::kBodyRows, 5);
  clip.root_position_W_m = Eigen::Matrix3Xd::Zero(3, 5);
  // T-posture, arms sideways: about the forward axis, + lifts the left arm and lowers the right
  const double lift[] = {-1.2, -0.5, 0.3, 1.1, 0.4};
  for (Index i = 0; i < 5; ++i) {
    clip.angles_rad(3 * mocap::kLeftShoulder, i) = lift[i];
    clip.angles_rad(3 * mocap::kRightShoulder, i) = lift[i];
    clip.root_position_W_m(2, i) = i == 0 ? 10.0 : 0.0;  // a leap counts for nothing
  }
  EXPECT_EQ(highest_hand(clip, mocap::kLeft), 3);
  EXPECT_EQ(highest_hand(clip, mocap::kRight), 0);
}

TEST(Graft, ComposesWalksWithRaises) {
  const auto clips = shared_data("data/mocap/bandai_nc");
  if (!std::filesystem::exists(clips)) GTEST_SKIP() << "not here: " << clips << " is absent";
  const GraftedSet set = walks_with_raises(clips);
  const Index rows = set.trials.rows_per_trial();
  ASSERT_EQ(static_cast<Index>(set.trials.trials.size()), set.walks + 12);
  EXPECT_GE(set.walks, 40);
  for (Index i = 0; i < 12; ++i) {
    const auto trial = set.trials.samples.middleRows((set.walks + i) * rows, rows);
    const double onset = 0.1 * static_cast<double>(i % 4);
    const auto before = static_cast<Index>(std::lround(100.0 * onset));
    for (const mocap::Side side : {mocap::kLeft, mocap::kRight}) {
      const bool raises = i / 4 == 2 || i / 4 == side;
      const Eigen::MatrixXd arm = trial(arm_rows(side), Eigen::all);
      const double moved = (arm.col(99) - arm.col(0)).norm();
      EXPECT_EQ(moved > 1.0, raises) << i << ' ' << side << ' ' << moved;
      if (!raises) continue;
      EXPECT_LT((arm.col(before) - arm.col(0)).norm(), 1e-9) << i;
      EXPECT_LT((arm.col(99) - arm.col(before + 61)).norm() * (before < 30), 1e-9) << i;
      EXPECT_GT((arm.col(before + 30) - arm.col(0)).norm(), 0.3) << i;
    }
    const auto legs = trial.middleRows(3, 18);  // hips to ankles, those of a cycle: they close
    EXPECT_LT((legs.col(99) - legs.col(0)).norm(), 0.3) << i;
  }
}

TEST(Graft, NamesAMissingClip) {
  const std::string refused = mimesis::testing::refusal([&] { walks_with_raises("/nowhere"); });
  EXPECT_NE(refused.find("/nowhere/dataset-1_walk-left"), std::string::npos) << refused;
}

}  // namespace
}  // namespace mimesis::synthesizer
