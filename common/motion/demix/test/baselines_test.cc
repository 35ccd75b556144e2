#include "common/motion/demix/baselines.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>

#include "common/error.h"
#include "common/motion/demix/test/known_mixture.h"

namespace mimesis::demix {
namespace {

double q(const mocap::Trials& set, const Mixture& m) {
  return quality(set.samples, m.reconstruct());
}

TEST(Baselines, PrincipalComponentsAreTheTruncatedDecomposition) {
  const Known known = known_mixture({.trials = 5, .rows = 7, .sources = 3, .seed = 3});
  const Eigen::MatrixXd x = known.set.samples.colwise() - known.set.samples.rowwise().mean();
  const Eigen::VectorXd s = x.jacobiSvd().singularValues();
  for (int k = 1; k <= 4; ++k) {
    const Mixture m = principal_components(known.set, k);
    const double rest = s.tail(s.size() - k).squaredNorm() / s.squaredNorm();
    EXPECT_NEAR(q(known.set, m), 1.0 - std::sqrt(rest), 1e-10) << k;
    const Eigen::MatrixXd gram = m.sources * m.sources.transpose() / double(m.sources.cols());
    EXPECT_LT((gram - Eigen::MatrixXd::Identity(k, k)).norm(), 1e-10);
    for (int i = 1; i < k; ++i) EXPECT_GE(m.weights.col(i - 1).norm(), m.weights.col(i).norm());
    EXPECT_TRUE((m.weights.colwise().sum().array() >= 0.0).all());
  }
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
  EXPECT_NEAR(q(set, ica), q(set, pca), 1e-12);
  const auto likeness = [&](const Mixture& m) {
    const Eigen::MatrixXd c = (m.sources * s.transpose() / kSamples).cwiseAbs();
    return std::max(std::min(c(0, 0), c(1, 1)), std::min(c(0, 1), c(1, 0)));
  };
  EXPECT_GT(likeness(ica), 0.995);
  EXPECT_LT(likeness(pca), 0.95);
}

TEST(Baselines, SinusoidsAreTheHarmonicsOfTheData) {
  Known known = known_mixture({.trials = 3, .rows = 4, .sources = 2, .seed = 9});
  const Mixture all = sinusoids(known.set, 31);  // T = 64: all but the Nyquist bin
  EXPECT_GT(q(known.set, all), 1.0 - 1e-9);
  const Mixture two = sinusoids(known.set, 2);
  EXPECT_LT(q(known.set, two), 1.0);
  EXPECT_LT((two.reconstruct() - two.means.replicate(1, 64)).rowwise().mean().norm(), 1e-10);
  for (Eigen::Index k = 0; k < 2; ++k) {
    EXPECT_NEAR(two.sources.row(k).squaredNorm() / 64.0, 1.0, 1e-12);
  }
}

TEST(Baselines, ParametersAreCountedAsInTheReference) {
  mocap::Trials set;  // the size of set A: 34 cycles of 51 rows, T = 100
  set.rows.resize(51);
  set.trials.resize(34);
  set.samples = Eigen::MatrixXd::Random(34 * 51, 100);
  EXPECT_EQ(parameter_count(sinusoids(set, 4), set, Delays::free), 14272);
  EXPECT_EQ(parameter_count(principal_components(set, 8), set, Delays::none), 14672);
  EXPECT_EQ(parameter_count(sinusoids(set, 4), set, Delays::tied), 400 + 4 * 1734 + 4 * 51);
  EXPECT_EQ(components_of_equal_size(set, 14272), 8);
}

TEST(Baselines, RefuseWhatCannotBe) {
  const Known known = known_mixture({});
  EXPECT_THROW(principal_components(known.set, 0), ConfigError);
  EXPECT_THROW(independent_components(known.set, 99), ConfigError);
  EXPECT_THROW(sinusoids(known.set, 32), ConfigError);
}

}  // namespace
}  // namespace mimesis::demix
