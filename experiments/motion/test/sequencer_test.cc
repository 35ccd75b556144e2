#include "experiments/motion/sequencer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/error.h"
#include "common/math/circle.h"

namespace mimesis::synthesizer {
namespace {

constexpr double kSequencerPi = std::numbers::pi;

/// One row: mean, a ramp as fixed source, one periodic source.
MotionParameters sequencer_one_row(double mean, double ramp, double wave, double frequency = 6.0) {
  return {Eigen::VectorXd::Constant(1, mean), Eigen::RowVector2d(ramp, wave),
          Eigen::RowVector2d(0.0, 0.4), frequency};
}

/// Joint angle at phase φ in [0, 2π) of an action.
double sequencer_angle(const MotionParameters& p, double phase) {
  return p.mean_rad[0] + p.weight_rad(0, 0) * std::cos(0.5 * phase) +
         p.weight_rad(0, 1) * std::cos(phase - p.delay_rad(0, 1));
}

TEST(Sequencer, PlaysWhatWasAnnouncedAroundPhaseZero) {
  const MotionParameters a = sequencer_one_row(0.0, 0.4, 0.1, 6.0),
                         b = sequencer_one_row(1.0, -0.3, 0.2, 8.0);
  Sequencer s(a, 1);
  EXPECT_EQ(s.at(0.1).mean_rad[0], 0.0);
  ASSERT_TRUE(s.announce(b));
  double last = sequencer_angle(s.at(0.1), 0.1), worst = 0.0;
  for (int i = 1; i <= 2000; ++i) {
    const double phase = 0.1 + i * 0.005;  // whole turns are welcome
    const MotionParameters& m = s.at(phase);
    const double now = sequencer_angle(m, math::wrap_two_pi(phase));
    worst = std::max(worst, std::abs(now - last));
    last = now;
    if (phase < 2.0 * kSequencerPi - Sequencer::kBeta * kSequencerPi) {
      EXPECT_EQ(m.mean_rad[0], 0.0);
      EXPECT_EQ(s.transitions(), 0);
    }
    if (std::abs(phase - 2.0 * kSequencerPi) < 0.003) {
      EXPECT_NEAR(m.frequency_rad_s, 7.0, 0.02);
      EXPECT_TRUE(s.in_transition());
    }
    if (phase > 2.0 * kSequencerPi + Sequencer::kBeta * kSequencerPi) {
      EXPECT_EQ(m.mean_rad[0], 1.0);
      EXPECT_EQ(s.transitions(), 1);
      EXPECT_FALSE(s.in_transition());
    }
  }
  EXPECT_LT(worst, 0.02);  // 1.0 over 0.4π rad in steps of 0.005, with the sources: no jump
}

TEST(Sequencer, RefusesToChangeItsMindWithinATransition) {
  const MotionParameters a = sequencer_one_row(0.0, 0.0, 0.0), b = sequencer_one_row(1.0, 0.0, 0.0),
                         c = sequencer_one_row(2.0, 0.0, 0.0);
  Sequencer s(a, 1);
  (void)s.at(3.0);
  EXPECT_TRUE(s.announce(b));
  EXPECT_TRUE(s.announce(c));  // in place of b
  (void)s.at(5.0);
  (void)s.at(2.0 * kSequencerPi - 0.1);
  EXPECT_FALSE(s.announce(b));
  EXPECT_NEAR(s.at(2.0 * kSequencerPi + 0.7).mean_rad[0], 2.0, 1e-15);
  EXPECT_FALSE(s.announced());
  EXPECT_TRUE(s.announce(a));
}

TEST(Sequencer, FollowsAStepBackOverTheCrossing) {
  const MotionParameters a = sequencer_one_row(0.0, 0.0, 0.0), b = sequencer_one_row(1.0, 0.0, 0.0);
  Sequencer s(a, 1, 6.0);
  ASSERT_EQ(s.announce(b), false);
  Sequencer t(a, 1, 5.0);
  ASSERT_TRUE(t.announce(b));
  (void)t.at(6.2);
  (void)t.at(6.3);
  EXPECT_NEAR(t.at(6.27).mean_rad[0], 0.5, 1e-12);
  EXPECT_EQ(t.transitions(), 1);
  EXPECT_GT(t.at(6.4).mean_rad[0], 0.5);
  EXPECT_EQ(t.transitions(), 1);
}

TEST(Sequencer, ConfigurationErrors) {
  EXPECT_THROW(Sequencer(sequencer_one_row(0, 0, 0), 1, 0.0, 0.0), ConfigError);
  EXPECT_THROW(Sequencer(sequencer_one_row(0, 0, 0), 1, 0.0, 1.1), ConfigError);
  EXPECT_THROW(Sequencer(sequencer_one_row(0, 0, 0), 3), ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
