#include "experiments/motion/baselines.h"

#include <gtest/gtest.h>

#include <cmath>

namespace mimesis::demix {
namespace {

double approximation(const mocap::Trials& set, const Mixture& m) {
  return quality(set.samples, m.reconstruct());
}

/// Two sources of very different shape, no delays: PCA mixes them, ICA does not.
TEST(Baselines, IndependentComponentsFindWhatWasMixed) {
  constexpr int kSamples = 200, kTrials = 20;
  mocap::Trials set;
  set.rows = {"a", "b"};
  set.trials.resize(kTrials);
  Eigen::MatrixXd s(2, kSamples);
  for (int t = 0; t < kSamples; ++t) {
    s(0, t) = t % 20 < 10 ? 1.0 : -1.0;                        // square, ten periods
    s(1, t) = std::sqrt(3.0) * (2.0 * (t % 50) / 49.0 - 1.0);  // saw tooth, four periods
  }
  set.samples.resize(2 * kTrials, kSamples);
  for (int n = 0; n < 2 * kTrials; ++n) {
    const double a = std::cos(0.1 * n) + 0.8, b = 0.9 * std::sin(0.13 * n) + 0.7;
    set.samples.row(n) = a * s.row(0) + b * s.row(1) + Eigen::RowVectorXd::Constant(kSamples, 0.3);
  }
  const Mixture pca = principal_components(set, 2),
                ica = independent_components(set, 2, 8);  // Newton steps
  EXPECT_NEAR(approximation(set, ica), approximation(set, pca), 1e-12);
  const auto likeness = [&](const Mixture& m) {
    const Eigen::MatrixXd c = (m.sources * s.transpose() / kSamples).cwiseAbs();
    return std::max(std::min(c(0, 0), c(1, 1)), std::min(c(0, 1), c(1, 0)));
  };
  EXPECT_GT(likeness(ica), 0.995);
  EXPECT_LT(likeness(pca), 0.95);
}

}  // namespace
}  // namespace mimesis::demix
