#include "nodes/crowd/certificate/contraction.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <cmath>
#include <random>

namespace mimesis::crowd {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

VectorXd eigenvalues(const MatrixXd& symmetric) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(symmetric, Eigen::EigenvaluesOnly).eigenvalues();
}

MatrixXd anticommutator(const MatrixXd& a, const MatrixXd& b) { return a * b + b * a; }

/// [[1+z, 0], [0, 1-z]] turned by `angle`.
Eigen::Matrix2d turned(double z, double angle) {
  const double c = std::cos(angle), s = std::sin(angle);
  const Eigen::Matrix2d v = (Eigen::Matrix2d() << c, -s, s, c).finished();
  return v * Eigen::Vector2d(1 + z, 1 - z).asDiagonal() * v.transpose();
}

TEST(Theorem6, LargestNumbersOfAgents) {  // shared/reference/crowd.md
  struct Row {
    Topology topology;
    Condition condition;
    int n[3];  // beta .3, .5, .7
  };
  const Row rows[] = {{Topology::chain, Condition::theorem6, {5, 9, 17}},
                      {Topology::ring, Condition::theorem6, {10, 18, 35}},
                      {Topology::star, Condition::theorem6, {11, 33, 126}},
                      {Topology::chain, Condition::weak, {2, 2, 3}},  // 2: none but the pair
                      {Topology::ring, Condition::weak, {3, 5, 7}},
                      {Topology::star, Condition::weak, {2, 2, 5}}};
  const double betas[] = {0.3, 0.5, 0.7};
  for (const Row& row : rows) {
    for (int k = 0; k < 3; ++k) {
      EXPECT_EQ(largest_agents(row.topology, betas[k], row.condition), row.n[k])
          << to_string(row.topology) << " beta " << betas[k];
    }
  }
  for (const double beta : {0.01, 0.5, 1.0}) {
    EXPECT_EQ(largest_agents(Topology::all_to_all, beta, Condition::weak), std::nullopt);
  }
  EXPECT_EQ(largest_agents(Topology::star, 1.0, Condition::theorem6), std::nullopt);
}

TEST(Theorem6, LargestNumberIsExact) {  // the next larger graph does not meet it
  for (const Topology topology :
       {Topology::chain, Topology::ring, Topology::star, Topology::wheel}) {
    for (double beta = 0.05; beta < 0.95; beta += 0.09) {
      const int n = largest_agents(topology, beta, Condition::theorem6).value();
      EXPECT_LT(theorem6_sum(extremes(topology, n).ratio(), beta), 1.0);
      EXPECT_GE(theorem6_sum(extremes(topology, n + 1).ratio(), beta), 1.0);
    }
  }
}

TEST(Theorem6, BoundaryAt45Degrees) {  // shared/reference/crowd.md: z = .6, eta .79 and .81
  for (const auto& [eta, least] : {std::pair{0.79, 0.01596}, {0.81, -0.01604}}) {
    const VectorXd found = eigenvalues(anticommutator(turned(eta, 0.0), turned(0.6, M_PI / 4)));
    EXPECT_NEAR(found[0], least, 5e-6);
    EXPECT_NEAR(found[0], 2.0 * (1.0 - std::hypot(0.6, eta)), 1e-12);
    const double alpha = (1 - 0.6) / 1.6, beta = (1 - eta) / (1 + eta);
    EXPECT_EQ(theorem6_sum(alpha, beta) < 1.0, least > 0.0);
    EXPECT_NEAR(theorem6_sum(alpha, beta), 0.36 + eta * eta, 1e-12);
  }
}

/// Least eigenvalue of (AB + BA)/2 that spectra of A and B in these ranges allow (0 < least <=
/// most); attained by some pair of 2×2 matrices. With centres a, b and half ranges ζ, η:
///   a b (1 − ζ)(1 − η)      if ζ + η <= 1,
///   a b (1 − ζ² − η²)/2     otherwise; its sign is that of theorem 6.
/// From (Au, Bu) >= min (p, q) over |p − u| <= ζ, |q − u| <= η, |u| = 1. The 45 degrees of
/// [M18 B.3.1] give a b (1 − √(ζ² + η²)), which is larger except on the boundary.
double least_anticommutator(double a_least, double a_most, double b_least, double b_most) {
  const double centre = 0.25 * (a_least + a_most) * (b_least + b_most);
  const double zeta = half_range(a_least / a_most), eta = half_range(b_least / b_most);
  if (zeta + eta <= 1.0) return centre * (1.0 - zeta) * (1.0 - eta);
  return 0.5 * centre * (1.0 - zeta * zeta - eta * eta);
}

TEST(Theorem6, BoundIsAttainedAndNeverPassedInThePlane) {
  for (const double z : {0.2, 0.5, 0.6, 0.9}) {
    for (const double eta : {0.1, 0.45, 0.79, 0.95}) {
      const double bound = least_anticommutator(1 - z, 1 + z, 1 - eta, 1 + eta);
      double least = 9.0;
      for (int i = 0; i <= 4000; ++i) {
        const double angle = M_PI * i / 4000;
        const MatrixXd both = anticommutator(turned(eta, 0.0), turned(z, angle));
        least = std::min(least, 0.5 * eigenvalues(both)[0]);
      }
      EXPECT_GE(least, bound - 1e-12) << z << ' ' << eta;
      EXPECT_LE(least, bound + 1e-5) << z << ' ' << eta;
    }
  }
}

MatrixXd random_spectrum(int n, double least, double most, std::mt19937& random) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(least, most);
  const MatrixXd any = MatrixXd::NullaryExpr(n, n, [&] { return normal(random); });
  const MatrixXd q = Eigen::HouseholderQR<MatrixXd>(any).householderQ();
  VectorXd d = VectorXd::NullaryExpr(n, [&] { return uniform(random); });
  d[0] = least, d[n - 1] = most;
  return q * d.asDiagonal() * q.transpose();
}

/// β > ((1 − α)/(1 + 3α))² or the same with both exchanged [M18 B.18, B.19]: between the weak
/// condition and theorem 6.
bool stronger_condition(double alpha, double beta) {
  const auto between = [](double ratio, double other) {
    const double root = (1.0 - ratio) / (1.0 + 3.0 * ratio);
    return other > root * root;
  };
  return between(alpha, beta) || between(beta, alpha);
}

TEST(Theorem6, NoViolationInRandomPairs) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(0.02, 1.0);
  int met = 0, weak = 0, stronger = 0;
  for (int trial = 0; trial < 20'000; ++trial) {
    const double alpha = uniform(random), beta = uniform(random);
    const int n = 2 + trial % 7;
    const MatrixXd a = random_spectrum(n, alpha, 1.0, random);
    const MatrixXd b = random_spectrum(n, beta, 1.0, random);
    const double least = 0.5 * eigenvalues(anticommutator(a, b))[0];
    EXPECT_GE(least, least_anticommutator(alpha, 1.0, beta, 1.0) - 1e-12);
    const bool sufficient = theorem6_sum(alpha, beta) < 1.0;
    met += sufficient;
    weak += weak_condition(alpha, beta);
    stronger += stronger_condition(alpha, beta);
    if (sufficient) {
      EXPECT_GT(least, 0.0);
    }
    if (weak_condition(alpha, beta)) {
      EXPECT_TRUE(stronger_condition(alpha, beta));
    }
    if (stronger_condition(alpha, beta)) {
      EXPECT_TRUE(sufficient) << alpha << ' ' << beta;
    }
  }
  EXPECT_GT(met, 15'000);
  EXPECT_LT(weak, stronger);
  EXPECT_LT(stronger, met);
  RecordProperty("pairs", met);
}

TEST(Theorem6, NarrowerConditionsEndWhereTheyAreWritten) {  // alpha = .5
  EXPECT_TRUE(weak_condition(0.5, 0.334));
  EXPECT_FALSE(weak_condition(0.5, 0.333));
  EXPECT_TRUE(stronger_condition(0.5, 0.0401));  // (.5/2.5)^2
  EXPECT_FALSE(stronger_condition(0.5, 0.0399));
  EXPECT_TRUE(stronger_condition(0.0401, 0.5));
  EXPECT_FALSE(stronger_condition(0.0399, 0.5));
}

TEST(Theorem6, GaitRatioIsItsInverse) {
  for (const double alpha : {0.01, 0.1, 0.5, 0.99}) {
    EXPECT_NEAR(theorem6_sum(alpha, least_gait_ratio(alpha)), 1.0, 1e-12);
  }
  EXPECT_EQ(least_gait_ratio(1.0), 0.0);
}

/// Λ and D̃ of a Laplacian and a diagonal.
struct Pair {
  VectorXd lambda;
  MatrixXd d;
};

Pair on_complement(const MatrixXd& laplacian, const VectorXd& g) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(laplacian);
  const long n = g.size();
  const MatrixXd v = solver.eigenvectors().rightCols(n - 1);
  return {solver.eigenvalues().tail(n - 1), v.transpose() * g.asDiagonal() * v};
}

TEST(Contraction, StarThatTheorem6RefusesStillContracts) {  // crowd.md: star N=10, beta .1
  const VectorXd g = (VectorXd(10) << 1, 1, 1, 1, 1, 0.1, 0.1, 0.1, 0.1, 0.1).finished();
  const Pair p = on_complement(CouplingGraph::make(Topology::star, 10).laplacian(), g);
  EXPECT_NEAR(theorem6_sum(extremes(Topology::star, 10).ratio(), 0.1), 1.34, 5e-3);
  const MatrixXd both = p.lambda.asDiagonal() * p.d + p.d * p.lambda.asDiagonal();
  EXPECT_GT(eigenvalues(both)[0], 0.0);
}

TEST(Contraction, InTheMetricOfTheGraphEveryConnectedGraphContracts) {
  std::mt19937 random(9);
  std::uniform_real_distribution<double> uniform(0.1, 1.0);
  int refused = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const auto topology = trial % 3 == 0   ? Topology::chain
                          : trial % 3 == 1 ? Topology::ring
                                           : Topology::star;
    const int n = 3 + trial % 18;
    VectorXd g = VectorXd::NullaryExpr(n, [&] { return uniform(random); });
    const Pair p = on_complement(CouplingGraph::make(topology, n).laplacian(), g);
    refused += theorem6_sum(extremes(topology, n).ratio(), g.minCoeff() / g.maxCoeff()) > 1.0;
    const MatrixXd root = p.lambda.cwiseSqrt().asDiagonal();
    const MatrixXd s = root * p.d * root;
    const double bound = g.minCoeff() * p.lambda[0];
    EXPECT_GE(eigenvalues(s)[0], bound - 1e-12);
    // the rates of ΛD̃ itself are those of S
    EXPECT_GE((p.lambda.asDiagonal() * p.d).eigenvalues().real().minCoeff(), bound - 1e-9);
    EXPECT_LE((p.lambda.asDiagonal() * p.d).eigenvalues().imag().cwiseAbs().maxCoeff(), 1e-9);
  }
  EXPECT_GT(refused, 100);
}

TEST(LowPass, JacobianOfThePaperFallsIntoBlocksInTheMetricOfTheGraph) {
  std::mt19937 random(2);
  std::uniform_real_distribution<double> uniform(0.3, 1.0);
  const double m = 0.4;
  for (const auto topology : {Topology::chain, Topology::ring, Topology::all_to_all}) {
    const int n = 7;
    VectorXd g = VectorXd::NullaryExpr(n, [&] { return uniform(random); });
    g[0] = 0.3, g[1] = 1.0;
    const Pair p = on_complement(CouplingGraph::make(topology, n).laplacian(), g);
    const double bound = m * 1.0 * p.lambda[n - 2];
    for (const double alpha : {1.1 * bound, 3.0 * bound, 30.0 * bound}) {
      // φ̇ = −m ε, ε̇ = α (L D φ − ε) in coordinates x = φ − (m/α) ε, y = −(m/α) ε, scaled by Λ^-½
      const MatrixXd id = MatrixXd::Identity(n - 1, n - 1), zero = MatrixXd::Zero(n - 1, n - 1);
      const MatrixXd ld = p.lambda.asDiagonal() * p.d;
      MatrixXd j(2 * n - 2, 2 * n - 2), to_xy(2 * n - 2, 2 * n - 2), theta = j;
      j << zero, -m * id, alpha * ld, -alpha * id;
      to_xy << id, -m / alpha * id, zero, -m / alpha * id;
      const MatrixXd scale = p.lambda.cwiseSqrt().cwiseInverse().asDiagonal();
      theta = MatrixXd::Zero(2 * n - 2, 2 * n - 2);
      theta.topLeftCorner(n - 1, n - 1) = scale;
      theta.bottomRightCorner(n - 1, n - 1) = scale;
      const MatrixXd metric = theta * to_xy;
      const MatrixXd f = metric * j * metric.inverse();
      const MatrixXd symmetric = 0.5 * (f + f.transpose());
      EXPECT_LT(symmetric.topRightCorner(n - 1, n - 1).cwiseAbs().maxCoeff(), 1e-9);
      const double rate = low_pass_rate(m, alpha, 0.3, 1.0, p.lambda[0], p.lambda[n - 2]);
      EXPECT_GT(rate, 0.0);
      EXPECT_LE(rate, -eigenvalues(symmetric)[2 * n - 3] + 1e-9);
    }
    EXPECT_LE(low_pass_rate(m, bound, 0.3, 1.0, p.lambda[0], p.lambda[n - 2]), 1e-12);
  }
}

TEST(LowPass, SlowestModeOfTheLinearLoop) {  // roots of s^2 + a s + a s0
  for (const double a : {0.5, 2.0, 40.0}) {
    const double s0 = 0.3;
    const double root = a * a - 4 * a * s0;
    const double slow = root > 0 ? 0.5 * (a - std::sqrt(root)) : 0.5 * a;
    EXPECT_NEAR(low_pass_mode_rate(a, s0), slow, 1e-12);
  }
  EXPECT_NEAR(low_pass_mode_rate(1e6, 0.3), 0.3, 1e-6);
}

}  // namespace
}  // namespace mimesis::crowd
