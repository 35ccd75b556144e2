#include "experiments/motion/closed_cycles.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "common/error.h"

namespace mimesis::synthesizer {
namespace {

constexpr Eigen::Index kSamples = 100;

mocap::Trials wave_with_drift(double drift) {
  mocap::Trials set{{"knee.y"}, {}, {mocap::Trial{}}, Eigen::MatrixXd(1, kSamples)};
  for (Eigen::Index t = 0; t < kSamples; ++t) {
    const double share = static_cast<double>(t) / kSamples;
    set.samples(0, t) = 0.3 + std::cos(2.0 * std::numbers::pi * share + 0.7) + drift * share;
  }
  return set;
}

TEST(ClosedCycles, LoseTheirDrift) {
  for (const double drift : {0.4, -0.2}) {
    mocap::Trials set = wave_with_drift(drift);
    // the line takes part in the slopes at both ends: all of it is found
    EXPECT_NEAR(close_cycles(set), std::abs(drift), 1e-4);
    const Eigen::MatrixXd wave = wave_with_drift(0.0).samples.array() + 0.5 * drift;
    EXPECT_LT((set.samples - wave).cwiseAbs().maxCoeff(), 1e-4);
  }
}

TEST(ClosedCycles, StayIfTheyAreClosed) {
  mocap::Trials set = wave_with_drift(0.0);
  EXPECT_LT(close_cycles(set), 1e-4);
}

TEST(ClosedCycles, NeedSamples) {
  mocap::Trials set{{"knee.y"}, {}, {mocap::Trial{}}, Eigen::MatrixXd::Zero(1, 3)};
  EXPECT_THROW((void)close_cycles(set), ConfigError);
}

}  // namespace
}  // namespace mimesis::synthesizer
