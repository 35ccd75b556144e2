#include "common/motion/demix/sisa.h"

#include <gtest/gtest.h>

#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <set>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/motion/demix/test/known_mixture.h"
#include "common/testing/refusal.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;

double phase_distance(double a, double b) { return std::abs(math::wrap_pi(a - b)); }

TEST(Sisa, FindsSourcesWeightsAndDelaysOfAnyFractionOfASample) {
  const Known known = known_mixture({.trials = 6, .rows = 10, .sources = 1, .seed = 1});
  const SisaResult found = sisa(known.set, {.sources = 1, .turns = 200, .tolerance = 1e-10});
  EXPECT_GT(found.quality, 0.999999);
  const Mixture &m = found.mixture, &k = known.mixture;
  const double sign = m.weights(0, 0) * k.weights(0, 0) < 0.0 ? -1.0 : 1.0;
  const double turn = m.delay_rad(0, 0) - k.delay_rad(0, 0);
  for (Index n = 0; n < m.weights.rows(); ++n) {
    EXPECT_NEAR(m.weights(n, 0), sign * k.weights(n, 0), 1e-5) << n;
    EXPECT_LT(phase_distance(m.delay_rad(n, 0), k.delay_rad(n, 0) + turn), 1e-5) << n;
  }
}

TEST(Sisa, TwoFreeSourcesAreFoundExactly) {
  const Known known = known_mixture({.trials = 10, .rows = 10, .sources = 2, .seed = 3});
  const SisaResult found = sisa(known.set, {.sources = 2, .turns = 200, .tolerance = 1e-9});
  EXPECT_GT(found.quality, 0.9999);
  EXPECT_NEAR(found.quality, quality(known.set.samples, found.mixture.reconstruct()), 1e-12);
  EXPECT_NEAR(found.quality_squared,
              quality_squared(known.set.samples, found.mixture.reconstruct()), 1e-12);
}

TEST(Sisa, TiedDelaysAreFoundAndAreTheSameInAllTrials) {
  const Known known =
      known_mixture({.trials = 12, .rows = 8, .sources = 2, .tied = true, .seed = 2});
  const SisaResult found =
      sisa(known.set, {.sources = 2, .tied = true, .turns = 200, .tolerance = 1e-9});
  EXPECT_GT(found.quality, 0.9999);
  const Index rows = known.set.rows_per_trial();
  for (Index n = rows; n < known.set.samples.rows(); ++n) {
    EXPECT_EQ(found.mixture.delay_rad.row(n), found.mixture.delay_rad.row(n % rows)) << n;
  }
}

TEST(Sisa, TheErrorNeverRises) {
  const Known known = known_mixture({.trials = 8, .rows = 9, .sources = 4, .seed = 4});
  for (const bool tied : {false, true}) {
    for (const bool nonnegative : {false, true}) {
      const SisaResult found =
          sisa(known.set, {.sources = 2, .tied = tied, .nonnegative = nonnegative});
      ASSERT_FALSE(found.trace.empty());
      for (std::size_t i = 1; i < found.trace.size(); ++i) {
        EXPECT_GE(found.trace[i], found.trace[i - 1] - 1e-9) << tied << nonnegative << i;
      }
      EXPECT_GE(found.quality, found.trace.back() - 1e-6) << tied << nonnegative;
    }
  }
}

TEST(Sisa, TiedIsNeverWorseThanPrincipalComponents) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const Known known = known_mixture({.trials = 5, .rows = 7, .sources = 5, .seed = seed});
    for (int k = 1; k <= 4; ++k) {
      const double pca =
          quality(known.set.samples, principal_components(known.set, k).reconstruct());
      EXPECT_GE(sisa(known.set, {.sources = k, .tied = true}).quality, pca - 1e-6) << seed << k;
    }
  }
}

TEST(Sisa, IsIndifferentToTheZeroOfTheClock) {
  const Known known = known_mixture({.trials = 6, .rows = 6, .sources = 1, .seed = 6});
  Known late = known;
  late.mixture.delay_rad.array() += 0.7;
  late.set.samples = late.mixture.reconstruct();
  const SisaResult a = sisa(known.set, {.sources = 1, .turns = 100, .tolerance = 1e-10});
  const SisaResult b = sisa(late.set, {.sources = 1, .turns = 100, .tolerance = 1e-10});
  EXPECT_LT((a.mixture.sources - b.mixture.sources).cwiseAbs().maxCoeff(), 1e-4);
  for (Index n = 0; n < a.mixture.weights.rows(); ++n) {
    EXPECT_LT(phase_distance(b.mixture.delay_rad(n, 0), a.mixture.delay_rad(n, 0) + 0.7), 1e-4);
  }
}

TEST(Sisa, SourcesAreInTheirGauge) {
  const Known known = known_mixture({.trials = 6, .rows = 9, .sources = 3, .seed = 7});
  const Mixture m = sisa(known.set, {.sources = 3}).mixture;
  for (Index k = 0; k < 3; ++k) {
    EXPECT_NEAR(m.sources.row(k).squaredNorm() / 64.0, 1.0, 1e-9);
    EXPECT_GE(m.weights.col(k).sum(), 0.0);
    if (k > 0) {
      EXPECT_LE(m.weights.col(k).squaredNorm(), m.weights.col(k - 1).squaredNorm());
    }
  }
  EXPECT_LE(m.delay_rad.cwiseAbs().maxCoeff(), 3.1415926535897936);
}

TEST(Sisa, NonNegativeWeightsAreNotNegative) {
  const Known known =
      known_mixture({.trials = 10, .rows = 10, .sources = 2, .nonnegative = true, .seed = 3});
  const SisaResult found =
      sisa(known.set, {.sources = 2, .nonnegative = true, .turns = 200, .tolerance = 1e-9});
  EXPECT_GE(found.mixture.weights.minCoeff(), 0.0);
  EXPECT_GT(found.quality, 0.98);
}

TEST(Sisa, FixedSourcesStayAndTheirMeansGoIntoTheRows) {
  Known known = known_mixture({.trials = 8, .rows = 8, .sources = 1, .seed = 8});
  const Eigen::MatrixXd ramp = non_periodic(1, 64);
  EXPECT_EQ(ramp(0, 0), 1.0);
  EXPECT_NEAR(ramp(0, 32), 0.0, 1e-12);  // φ = π
  for (Index n = 0; n < known.set.samples.rows(); ++n) {
    known.set.samples.row(n) += 0.1 * static_cast<double>(n % 5 - 2) * ramp;
  }
  const SisaResult found =
      sisa(known.set, {.sources = 2, .fixed = ramp, .turns = 200, .tolerance = 1e-10});
  EXPECT_EQ(found.mixture.fixed, 1);
  EXPECT_EQ(found.mixture.sources.row(0), ramp.row(0));
  EXPECT_TRUE(found.mixture.delay_rad.col(0).isZero(0.0));
  EXPECT_GT(found.quality, 0.99);
  const Eigen::MatrixXd x = found.mixture.reconstruct();
  EXPECT_LT((x.rowwise().mean() - known.set.samples.rowwise().mean()).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Sisa, StepwiseKeepsWhatIsKnown) {
  const Known known =
      known_mixture({.trials = 10, .rows = 8, .sources = 3, .tied = true, .seed = 11});
  Mixture first = known.mixture;  // the first action: two of the three
  first.sources.conservativeResize(2, Eigen::NoChange);
  first.weights.conservativeResize(Eigen::NoChange, 2);
  first.delay_rad.conservativeResize(Eigen::NoChange, 2);
  SisaOptions options{.sources = 3, .tied = true, .turns = 200, .tolerance = 1e-9};
  options.known = known_sources(first, known.set.rows_per_trial());
  const SisaResult found = sisa(known.set, options);
  EXPECT_EQ(found.mixture.sources.topRows(2), first.sources);
  for (Index n = 0; n < known.set.samples.rows(); ++n) {
    EXPECT_LT(phase_distance(found.mixture.delay_rad(n, 1), first.delay_rad(n, 1)), 1e-12);
  }
  EXPECT_GT(found.quality, 0.9999);
  EXPECT_LT((found.mixture.weights.leftCols(2) - first.weights).cwiseAbs().maxCoeff(), 1e-2);
}

TEST(Sisa, WeightsAloneWhereAllSourcesAreGiven) {
  const Known known =
      known_mixture({.trials = 6, .rows = 8, .sources = 2, .tied = true, .seed = 14});
  SisaOptions options{.sources = 2, .tied = true};
  options.known = known_sources(known.mixture, known.set.rows_per_trial());
  const SisaResult found = sisa(known.set, options);
  EXPECT_EQ(found.mixture.sources, known.mixture.sources);
  EXPECT_GT(found.quality, 0.9999);
  EXPECT_LT((found.mixture.weights - known.mixture.weights).cwiseAbs().maxCoeff(), 1e-6);
  for (const bool tied : {true, false}) {
    const SisaOptions fixed{.sources = 1, .tied = tied, .fixed = non_periodic(1, 64)};
    const SisaResult ramp = sisa(known.set, fixed);
    EXPECT_TRUE(ramp.mixture.weights.allFinite());
    EXPECT_GE(ramp.quality, 0.0);
  }
}

TEST(Sisa, ConstantRowsHaveNoWeight) {
  Known known = known_mixture({.trials = 4, .rows = 6, .sources = 2, .seed = 10});
  known.set.samples.row(3).setConstant(0.4);
  const Mixture m = sisa(known.set, {.sources = 2}).mixture;
  EXPECT_LT(m.weights.row(3).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_NEAR(m.means[3], 0.4, 1e-12);
}

TEST(Sisa, SameInputSameBits) {
  const Known known = known_mixture({.trials = 5, .rows = 6, .sources = 3, .seed = 11});
  const SisaResult a = sisa(known.set, {.sources = 3}), b = sisa(known.set, {.sources = 3});
  EXPECT_EQ(a.mixture.sources, b.mixture.sources);
  EXPECT_EQ(a.mixture.weights, b.mixture.weights);
  EXPECT_EQ(a.mixture.delay_rad, b.mixture.delay_rad);
}

TEST(Sisa, AnotherSeedMayEndInAnotherMinimumAndIsAsRepeatable) {
  const Known known = known_mixture({.trials = 5, .rows = 7, .sources = 5, .seed = 3});
  const auto learned = [&](std::uint32_t seed) {
    return sisa(known.set, {.sources = 3, .tied = true, .seed = seed});
  };
  std::set<double> qualities;
  for (std::uint32_t seed = 1; seed <= 4; ++seed) {
    const SisaResult found = learned(seed);
    EXPECT_EQ(found.mixture.sources, learned(seed).mixture.sources) << seed;
    qualities.insert(found.quality);
  }
  EXPECT_GT(qualities.size(), 1U);
}

std::string refusal(const mocap::Trials& set, const SisaOptions& options) {
  return testing::refusal([&] { sisa(set, options); }, "taken");
}

TEST(Sisa, RefusesWhatItCannotDo) {
  const Known known = known_mixture({.trials = 2, .rows = 3, .sources = 2, .seed = 12});
  mocap::Trials set = known.set;
  EXPECT_EQ(refusal(set, {.sources = 7}),
            "demix.sources: 7 is more than the set supports, expected at most 6: so many "
            "components describe it exactly");
  EXPECT_EQ(refusal(set, {.sources = 0}), "demix.sources: 0, expected at least 1");
  set.samples(4, 5) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(refusal(set, {.sources = 1}),
            "demix: row1 of trial 1 (made, cycle 1): sample 5 is not a finite number");
  EXPECT_EQ(refusal({}, {.sources = 1}),
            "demix: the set is empty, expected at least one trial with one row");
  set.samples.setConstant(1.0);
  EXPECT_EQ(refusal(set, {.sources = 1}), "demix: all rows are constant, expected motion");
  EXPECT_EQ(refusal(known.set, {.sources = 2, .fixed = Eigen::MatrixXd::Random(1, 9)}),
            "demix: fixed sources have 9 samples, expected 64 as the set");
}

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
