#include "experiments/motion/turning.h"

#include <gtest/gtest.h>

#include "common/error.h"

namespace mimesis::synthesizer {
namespace {

mocap::Trial turn_at(double turn, double duration) {
  mocap::Trial t;
  t.turn_rad = turn;
  t.duration_s = duration;
  return t;
}

TEST(Turning, SharesTurnAtTheRate) {
  const TurnRates r = turn_rates(turn_at(0.9, 1.2), turn_at(0.05, 1.0), turn_at(-0.8, 1.0));
  EXPECT_NEAR(r.left, 0.75, 1e-12);
  for (const double rate : {-0.8, -0.3, 0.05, 0.2, 0.75}) {
    const auto a = turn_shares(r, rate);
    EXPECT_NEAR(a[0] * r.left + a[1] * r.straight + a[2] * r.right, rate, 1e-12);
    EXPECT_NEAR(a[0] + a[1] + a[2], 1.0, 1e-12);
    EXPECT_EQ(a[0] > 0.0, rate > 0.05);  // left is left
    EXPECT_EQ(a[2] > 0.0, rate < 0.05);
  }
  EXPECT_EQ(turn_shares(r, 5.0)[0], 1.0);
  EXPECT_EQ(turn_shares(r, -5.0)[2], 1.0);
  EXPECT_THROW(turn_rates(turn_at(-0.8, 1.0), turn_at(0.0, 1.0), turn_at(0.9, 1.0)), ConfigError);
  EXPECT_THROW(turn_rates(turn_at(0.8, 0.0), turn_at(0.0, 1.0), turn_at(-0.9, 1.0)), ConfigError);
}

TEST(Turning, BalancedMixtureGoesStraight) {
  const auto walk = [](double w) {
    return MotionParameters{Eigen::VectorXd::Constant(1, w), Eigen::MatrixXd::Constant(1, 1, w),
                            Eigen::MatrixXd::Zero(1, 1), 6.0};
  };
  // the weight stands for the turning rate
  const double e = 0.04, l = 0.7, r = -0.6;
  const double beta = balancing_beta(e, l, r);
  const MotionParameters m = balanced_mixture(walk(e), walk(l), walk(r), beta);
  EXPECT_NEAR(m.weight_rad(0, 0), 0.0, 1e-15);
  EXPECT_NEAR(m.frequency_rad_s, 6.0, 1e-12);
  EXPECT_NEAR(balanced_mixture(walk(1), walk(2), walk(4), 0.5).weight_rad(0, 0),  // eq. 3.28
              0.75 + 0.125 * (1.5 * 2 + 0.5 * 4), 1e-15);
  EXPECT_EQ(balancing_beta(9.0, l, r), -1.0);
  EXPECT_THROW(balanced_mixture(walk(1), walk(2), walk(4), 1.5), ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
