#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>

#include "common/error.h"
#include "common/motion/demix/sisa.h"
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

TEST(Baselines, ParametersAreCountedAsInTheReference) {
  mocap::Trials set;  // the size of set A: 34 cycles of 51 rows, T = 100
  set.rows.resize(51);
  set.trials.resize(34);
  set.samples = Eigen::MatrixXd::Random(34 * 51, 100);
  EXPECT_EQ(parameter_count(principal_components(set, 4), set, Delays::free), 14272);
  EXPECT_EQ(parameter_count(principal_components(set, 8), set, Delays::none), 14672);
  EXPECT_EQ(parameter_count(principal_components(set, 4), set, Delays::tied),
            400 + 4 * 1734 + 4 * 51);
}

TEST(Baselines, RefuseWhatCannotBe) {
  const Known known = known_mixture({});
  EXPECT_THROW(principal_components(known.set, 0), ConfigError);
}

}  // namespace
}  // namespace mimesis::demix
