#include "common/motion/mocap/cycles.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "common/math/circle.h"
#include "common/motion/mocap/test/walker.h"

namespace mimesis::mocap {
namespace {

TEST(Cycles, FurtherRowsAreCutWithTheClip) {
  const BodyClip clip = walk({});
  MoreRows more{.names = {"left_hip", "still"}};
  more.values_rad = Eigen::MatrixXd::Constant(2, clip.frames(), 0.7);
  more.values_rad.row(0) = 2.0 * clip.angles_rad.row(3 * kLeftHip + 1);
  const auto trials = cut_cycles(clip, {}, more);
  ASSERT_TRUE(trials) << trials.error().reason;
  ASSERT_EQ(trials->rows.size(), kBodyRows + 2U);
  EXPECT_EQ(trials->rows[kBodyRows], "left_hip");
  ASSERT_EQ(trials->samples.rows(), 3 * (kBodyRows + 2));
  for (const Eigen::Index first : {0, kBodyRows + 2}) {  // filtered and resampled alike
    EXPECT_LT((trials->samples.row(first + kBodyRows) -
               2.0 * trials->samples.row(first + 3 * kLeftHip + 1))
                  .cwiseAbs()
                  .maxCoeff(),
              1e-12);
    EXPECT_NEAR(trials->samples(first + kBodyRows + 1, 50), 0.7, 1e-12);
  }
  more.values_rad = more.values_rad.leftCols(5).eval();
  EXPECT_THROW(cut_cycles(clip, {}, more), ConfigError);
}

TEST(Cycles, OfTheMadeUpWalkerStartAtTheLeftHeelStrike) {
  const Walker walker{.turn_rad_s = 0.5};
  const auto trials = cut_cycles(walk(walker));
  ASSERT_TRUE(trials) << trials.error().reason;
  ASSERT_EQ(trials->trials.size(), 3u);
  ASSERT_EQ(trials->samples.rows(), 3 * kBodyRows);
  ASSERT_EQ(trials->samples.cols(), 100);
  EXPECT_EQ(trials->rows[3 * kLeftHip + 1], "lhip.y");
  for (std::size_t i = 0; i < 3; ++i) {
    const Trial& trial = trials->trials[i];
    EXPECT_EQ(trial.cycle, static_cast<int>(i));
    EXPECT_EQ(trial.clip, "walker.bvh");
    EXPECT_NEAR(trial.duration_s, walker.period_s, 1.0 / walker.rate_hz + 1e-9);
    EXPECT_NEAR(trial.step_length_m, walker.speed_m_s * trial.duration_s, 1e-3);
    EXPECT_NEAR(trial.turn_rad, 0.5 * trial.duration_s, 1e-3);
    const Eigen::MatrixXd x =
        trials->samples.middleRows(static_cast<Eigen::Index>(i) * kBodyRows, kBodyRows);
    for (Eigen::Index t = 0; t < 100; ++t) {
      // a frame is 0.052 rad of phase, and the filter takes 2e-4 of the amplitude
      const double swing = walker.swing_rad * std::cos(math::kTwoPi * static_cast<double>(t) / 100);
      EXPECT_NEAR(x(3 * kLeftHip + 1, t), -swing, 0.03);
      EXPECT_NEAR(x(3 * kRightHip + 1, t), swing, 0.03);
    }
    EXPECT_LT(x.topRows(3).cwiseAbs().maxCoeff(), 1e-9);  // the heading is out
  }
  EXPECT_EQ(trials->trials[0].last_frame, trials->trials[1].first_frame);
}

// One left strike, between two right ones.
TEST(Cycles, FromRightToRightBeginAtTheLeftStrikeToo) {
  const Walker walker{.seconds = 1.7, .start_phase_rad = 2.0};
  const auto trials = cut_cycles(walk(walker));
  ASSERT_TRUE(trials) << trials.error().reason;
  ASSERT_EQ(trials->trials.size(), 1u);
  EXPECT_NEAR(static_cast<double>(trials->trials[0].first_frame), 0.2 * walker.rate_hz, 1.0);
  EXPECT_NEAR(trials->trials[0].duration_s, walker.period_s, 1.0 / walker.rate_hz + 1e-9);
  for (Eigen::Index t = 0; t < 100; ++t) {
    const double swing = walker.swing_rad * std::cos(math::kTwoPi * static_cast<double>(t) / 100);
    EXPECT_NEAR(trials->samples(3 * kLeftHip + 1, t), -swing, 0.03);
    EXPECT_NEAR(trials->samples(3 * kRightHip + 1, t), swing, 0.03);
  }
}

// The clip ends 40° of a period behind its second left strike, when the foot stands.
TEST(Cycles, StrikesNearTheEndsCountWhereThereIsNoOtherCycle) {
  const auto trials = cut_cycles(walk({.seconds = 2.147}));
  ASSERT_TRUE(trials) << trials.error().reason;
  ASSERT_EQ(trials->trials.size(), 1u);
  EXPECT_NEAR(static_cast<double>(trials->trials[0].first_frame), 0.925 * 120, 1.0);
  EXPECT_NEAR(static_cast<double>(trials->trials[0].last_frame), 2.025 * 120, 1.0);
}

TEST(Cycles, FramesAreCountedAsInTheFile) {
  BodyClip clip = walk({});
  const auto from_0 = cut_cycles(clip);
  clip.first_frame = 7;
  const auto from_7 = cut_cycles(clip);
  ASSERT_TRUE(from_0 && from_7);
  EXPECT_EQ(from_7->trials[0].first_frame, from_0->trials[0].first_frame + 7);
}

TEST(Cycles, SayWhyThereIsNone) {
  const auto standing = cut_cycles(walk({.swing_rad = 0.02, .speed_m_s = 0.0}));
  ASSERT_FALSE(standing);
  EXPECT_NE(standing.error().reason.find("walker.bvh: no heel strike"), std::string::npos);
  const auto one = cut_cycles(walk({.seconds = 1.2}));
  ASSERT_FALSE(one);
  EXPECT_NE(one.error().reason.find("less than one gait cycle"), std::string::npos);
  CycleOptions quick;
  quick.longest_s = 0.9;
  EXPECT_FALSE(cut_cycles(walk({}), quick));
  EXPECT_FALSE(cut_cycles(walk({.seconds = 2.0 / 120})));
}

TEST(Cycles, WholeClipsForWhatDoesNotRepeat) {
  const BodyClip clip = walk({.seconds = 3.0});
  CycleOptions options;
  options.cut = CycleOptions::Cut::whole_clip;
  options.style = "raise";
  options.samples = 50;
  const auto whole = cut_cycles(clip, options);
  ASSERT_TRUE(whole);
  ASSERT_EQ(whole->trials.size(), 1u);
  EXPECT_EQ(whole->trials[0].style, "raise");
  EXPECT_EQ(whole->trials[0].last_frame, 359);
  EXPECT_EQ(whole->samples.cols(), 50);
  EXPECT_NEAR(whole->samples(3 * kLeftHip + 1, 25), clip.angles_rad(3 * kLeftHip + 1, 179), 0.02);
  options.samples = 1;
  EXPECT_THROW((void)cut_cycles(clip, options), ConfigError);
}

TEST(Cycles, MergeKeepsOrderAndRefusesOtherSets) {
  const Trials a = *cut_cycles(walk({})), b = *cut_cycles(walk({.period_s = 0.9}));
  const Trials all = merge(std::array{a, b});
  ASSERT_EQ(all.trials.size(), a.trials.size() + b.trials.size());
  EXPECT_EQ(all.samples.bottomRows(b.samples.rows()), b.samples);
  EXPECT_EQ(all.samples.topRows(a.samples.rows()), a.samples);
  EXPECT_EQ(all.trials.back().duration_s, b.trials.back().duration_s);

  Trials other = b;
  other.rows[0] = "nose.x";
  EXPECT_THROW(merge(std::array{a, other}), ConfigError);
  CycleOptions options;
  options.samples = 64;
  EXPECT_THROW(merge(std::array{a, *cut_cycles(walk({}), options)}), ConfigError);
  EXPECT_THROW(merge({}), ConfigError);
}

TEST(Cycles, StylesFromFileNames) {
  EXPECT_EQ(style_of("dataset-1_walk_happy_001.bvh"), "happy");
  EXPECT_EQ(style_of("dataset-2_walk-turn-left_normal_001.bvh"), "walk-turn-left_normal");
  EXPECT_EQ(style_of("walk_sad_012.bvh"), "sad");
  EXPECT_EQ(style_of("07_01.bvh"), "");
  EXPECT_EQ(style_of("mine.bvh"), "");
}

}  // namespace
}  // namespace mimesis::mocap
