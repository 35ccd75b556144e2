#include <gtest/gtest.h>

#include <cmath>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/motion/demix/sisa.h"
#include "common/motion/demix/test/known_mixture.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// Largest change of slope of a periodic row.
double sharpest(const Eigen::RowVectorXd& s) {
  double most = 0.0;
  for (Index t = 0; t < s.size(); ++t) {
    const Index before = (t + s.size() - 1) % s.size(), after = (t + 1) % s.size();
    most = std::max(most, std::abs(s[before] - 2.0 * s[t] + s[after]));
  }
  return most;
}

/// Known sources with corners: triangles are added to them.
Known with_kinks() {
  Known known = known_mixture({.trials = 6, .rows = 8, .sources = 2, .tied = true, .seed = 5});
  Mixture& m = known.mixture;
  const Index samples = m.sources.cols();
  for (Index t = 0; t < samples; ++t) {
    const double phase = static_cast<double>(t) / static_cast<double>(samples);
    m.sources(0, t) += 1.5 - 6.0 * std::abs(phase - 0.5);
  }
  known.set.samples = m.reconstruct();
  return known;
}

TEST(SavitzkyGolay, HasThePrintedTaps) {  // Savitzky & Golay 1964: 5 points, quadratic
  MatrixXd unit = MatrixXd::Zero(1, 12);
  unit(0, 6) = 1.0;
  const MatrixXd out = savitzky_golay(unit, 2, 2);
  const double taps[] = {-3.0, 12.0, 17.0, 12.0, -3.0};
  for (Index i = 0; i < 5; ++i) EXPECT_NEAR(out(0, 4 + i), taps[i] / 35.0, 1e-14) << i;
  EXPECT_NEAR(out.sum(), 1.0, 1e-14);
}

TEST(SavitzkyGolay, KeepsPolynomialsAndGoesRoundTheEnd) {
  MatrixXd rows(2, 20);
  for (Index t = 0; t < 20; ++t) {
    const double x = static_cast<double>(t);
    rows(0, t) = 1.0 + x * (0.5 - x * (0.2 - 0.01 * x));
    rows(1, t) = std::cos(math::kTwoPi * x / 20.0);
  }
  const MatrixXd out = savitzky_golay(rows, 3, 3);
  for (Index t = 3; t < 17; ++t) EXPECT_NEAR(out(0, t), rows(0, t), 1e-11) << t;
  for (Index t = 0; t < 20; ++t) {  // an even filter scales a wave, the same everywhere
    EXPECT_NEAR(out(1, t), out(1, 0) * rows(1, t), 1e-12) << t;
  }
}

TEST(SavitzkyGolay, RefusesWindowsThatCannotBe) {
  const MatrixXd rows = MatrixXd::Zero(1, 10);
  EXPECT_THROW(savitzky_golay(rows, 1, 3), ConfigError);
  EXPECT_THROW(savitzky_golay(rows, -1, 0), ConfigError);
  EXPECT_THROW(savitzky_golay(rows, 2, -1), ConfigError);
  EXPECT_THROW(savitzky_golay(rows, 5, 2), ConfigError);
  EXPECT_NO_THROW(savitzky_golay(rows, 4, 2));
}

TEST(SmoothSources, RoundsCornersAndFitsTheWeightsAnew) {
  const Known known = with_kinks();
  const Mixture& before = known.mixture;
  const SisaResult smooth = smooth_sources(known.set, before, {.half_window = 4, .order = 2});
  EXPECT_LT(sharpest(smooth.mixture.sources.row(0)), 0.7 * sharpest(before.sources.row(0)));
  EXPECT_GT(smooth.quality, 0.95);
  EXPECT_LT(smooth.quality, 1.0);
  EXPECT_NEAR(smooth.quality, quality(known.set.samples, smooth.mixture.reconstruct()), 1e-12);
  EXPECT_EQ(smooth.mixture.delay_rad, before.delay_rad);
  for (Index k = 0; k < 2; ++k) {
    EXPECT_NEAR(smooth.mixture.sources.row(k).squaredNorm(),
                static_cast<double>(before.sources.cols()), 1e-9);
  }
  // no other weights for these sources and delays are better: any change costs
  for (const double step : {-0.01, 0.01}) {
    for (Index k = 0; k < 2; ++k) {
      Mixture other = smooth.mixture;
      other.weights.col(k) *= 1.0 + step;
      EXPECT_LT(quality(known.set.samples, other.reconstruct()), smooth.quality);
    }
  }
}

TEST(SmoothSources, FixedSourcesStay) {
  Known known = known_mixture({.trials = 6, .rows = 8, .sources = 2, .seed = 6});
  const MatrixXd ramp = non_periodic(1, known.set.samples.cols());
  for (Index n = 0; n < known.set.samples.rows(); ++n) {
    known.set.samples.row(n) += 0.1 * static_cast<double>(n % 5) * ramp;
  }
  const SisaResult found = sisa(known.set, {.sources = 3, .fixed = ramp});
  const SisaResult smooth = smooth_sources(known.set, found.mixture, {.half_window = 2});
  EXPECT_EQ(smooth.mixture.sources.row(0), found.mixture.sources.row(0));
  EXPECT_EQ(smooth.mixture.fixed, 1);
  EXPECT_GT(smooth.quality, found.quality - 0.02);
  const Eigen::VectorXd miss = (known.set.samples - smooth.mixture.reconstruct()).rowwise().mean();
  EXPECT_LT(miss.cwiseAbs().maxCoeff(), 1e-12);  // the ramp's mean is in the rows' means
}

TEST(SmoothSources, NonNegativeWeightsStaySo) {
  const Known known =
      known_mixture({.trials = 6, .rows = 8, .sources = 3, .nonnegative = true, .seed = 7});
  const SisaResult found = sisa(known.set, {.sources = 2, .nonnegative = true});
  const SisaResult smooth =
      smooth_sources(known.set, found.mixture, {.half_window = 5, .order = 1, .nonnegative = true});
  EXPECT_GE(smooth.mixture.weights.minCoeff(), 0.0);
}

}  // namespace
}  // namespace mimesis::demix
