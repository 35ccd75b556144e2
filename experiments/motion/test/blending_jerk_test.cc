#include "experiments/motion/blending_jerk.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "common/motion/demix/sisa.h"
#include "common/motion/mocap/cycles.h"
#include "common/motion/mocap/test/shared_folder.h"
#include "common/motion/model/motion_model.h"
#include "experiments/motion/closed_cycles.h"
#include "experiments/motion/rotation_branches.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kPi = std::numbers::pi;

/// Two styles of one row, m + w cos φ.
motion::MotionModel waves(double mean_1, double weight_1, double mean_2, double weight_2) {
  motion::MotionModel model;
  model.rows = {"knee.y"};
  model.tied = true;
  model.sources.resize(1, 20);
  for (Eigen::Index t = 0; t < 20; ++t) {
    model.sources(0, t) = std::cos(2.0 * kPi * static_cast<double>(t) / 20.0);
  }
  const auto add = [&](const char* style, double mean, double weight) {
    motion::Pattern p;
    p.trial.style = style;
    p.trial.duration_s = 1.0;
    p.mean_rad = Eigen::VectorXd::Constant(1, mean);
    p.weight_rad = Eigen::MatrixXd::Constant(1, 1, weight);
    p.delay_rad = Eigen::MatrixXd::Zero(1, 1);
    model.patterns.push_back(p);
  };
  add("one", mean_1, weight_1);
  add("two", mean_2, weight_2);
  return model;
}

TEST(BlendingJerk, OfAStyleToItselfIsOne) {
  const motion::MotionModel model = waves(0.1, 0.3, 0.1, 0.3);
  const auto pairs = blending_jerk(model, styles_of(model), {});
  ASSERT_EQ(pairs.size(), 2u);
  for (const BlendingJerk& p : pairs) {
    EXPECT_NEAR(p.ratio, 1.0, 1e-3);
    EXPECT_NEAR(p.of_larger, 1.0, 1e-3);
    // around φ = 0 of cos φ, where sin φ is small: over ±0.2 s less than over the cycle
    const double share = 1.0 - std::sin(0.8 * kPi) / (0.8 * kPi);
    EXPECT_NEAR(p.of_cycle, std::sqrt(share), 0.02);
    // |d³/dt³| = w ω³ |sin φ|; differences at 60 Hz: ω → 120 sin(ω/120)
    const double rate = 120.0 * std::sin(2.0 * kPi / 120.0);
    EXPECT_NEAR(p.jerk_rad_s3, 0.3 * std::pow(rate, 3) * std::sqrt(0.5 * share), 0.3);
  }
}

TEST(BlendingJerk, OfACutIsThatOfAStep) {
  // a jump by d: third differences d, −2d, d (in any place between two frames)
  const motion::MotionModel model = waves(0.0, 1e-6, 0.5, 1e-6);
  const auto pairs = blending_jerk(model, styles_of(model), {.cut = true});
  EXPECT_NEAR(pairs[0].jerk_rad_s3, 0.5 * std::pow(60.0, 3) * std::sqrt(6.0 / 24.0), 10.0);
  const Spread s = spread(pairs, &BlendingJerk::jerk_rad_s3, 1.0);
  EXPECT_EQ(s.within, 0);
  EXPECT_GE(s.worst, s.median);
}

TEST(BlendingJerk, IsRelativeToBothOrToTheLarger) {
  const motion::MotionModel model = waves(0.0, 0.1, 0.0, 0.3);
  const auto pairs = blending_jerk(model, styles_of(model), {});
  EXPECT_EQ(pairs[0].from, "one");
  EXPECT_EQ(pairs[0].to, "two");
  EXPECT_NEAR(pairs[0].ratio / pairs[0].of_larger, std::sqrt(0.09 / 0.05), 1e-3);
}

/// Tied delays, learned well enough to test control with: 0.002 of Q less, a fifth of the time.
motion::MotionModel tied_model(const mocap::Trials& set, int sources) {
  const demix::SisaOptions options{.sources = sources, .tied = true, .turns = 12, .finalists = 1};
  return motion::make_model(set, demix::sisa(set, options).mixture, true, mocap::standard_body());
}

class RecordedStyles : public ::testing::Test {
 protected:
  void SetUp() override {
    const std::string file = mocap::shared_mocap() + "/sets/B.csv";
    if (!std::filesystem::exists(file)) GTEST_SKIP() << "not here: " << file << " is absent";
    set_ = mocap::read_trials(file);
    for (mocap::Trial& t : set_.trials) {  // "walk-turn-left_normal", "walk-left_normal": left
      const std::string style = mocap::style_of(t.clip), way = style.substr(0, style.find('_'));
      t.style = way.substr(way.rfind('-') + 1);
    }
  }
  mocap::Trials set_;
};

/// With 8 sources every pair is below the goal, but not because they blend better: the model has
/// learned the jump between the end and the beginning of the recorded cycles, which is steady jerk
/// just where the transition is. With closed cycles it is as with 5.
TEST_F(RecordedStyles, DISABLED_SlowWithEightSourcesTheSeamsOfTheCyclesHideTheTransition) {
  align_rotation_branches(set_);
  motion::MotionModel model = tied_model(set_, 8);
  const auto seams = blending_jerk(model, styles_of(model), {});
  EXPECT_LE(spread(seams, &BlendingJerk::ratio, 1.15).worst, 1.15);
  EXPECT_GT(close_cycles(set_), 0.005);
  model = tied_model(set_, 8);
  const auto closed = blending_jerk(model, styles_of(model), {});
  EXPECT_GT(spread(closed, &BlendingJerk::ratio, 1.15).worst, 1.4);
  EXPECT_LE(spread(closed, &BlendingJerk::ratio, 1.15).worst, 1.9);
}

TEST_F(RecordedStyles, DISABLED_SlowWithoutAlignedBranchesItIsTwiceAsMuch) {
  const motion::MotionModel model = tied_model(set_, 5);
  const auto pairs = blending_jerk(model, styles_of(model), {});
  EXPECT_GT(spread(pairs, &BlendingJerk::ratio, 1.15).worst, 2.5);
}

}  // namespace
}  // namespace mimesis::synthesizer
