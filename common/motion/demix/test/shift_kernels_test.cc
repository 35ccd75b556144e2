// The inner loops against their definitions.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>
#include <vector>

#include "common/motion/demix/spectrum.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::MatrixXf;
using Eigen::VectorXd;

class Numbers {
 public:
  explicit Numbers(unsigned seed) : random_(seed) {}
  double next() { return static_cast<double>(random_()) / 2147483648.0 - 1.0; }
  MatrixXd matrix(Index rows, Index cols) {
    return MatrixXd::NullaryExpr(rows, cols, [this] { return next(); });
  }

 private:
  std::mt19937 random_;
};

MatrixXd positive(Numbers& numbers, Index n) {
  const MatrixXd a = numbers.matrix(n + 2, n);
  return a.transpose() * a;
}

TEST(SmallCholesky, Solves) {
  Numbers numbers(1);
  for (Index n = 1; n <= 7; ++n) {
    const MatrixXd a = positive(numbers, n);
    const VectorXd b = numbers.matrix(n, 1);
    MatrixXd factor = a;
    VectorXd x = b, y = b;
    small_cholesky(factor, n, 1e-14);
    small_solve(factor, n, x.data());
    small_forward(factor, n, y.data());
    EXPECT_LT((a * x - b).norm(), 1e-9 * b.norm()) << n;
    EXPECT_NEAR(y.squaredNorm(), b.dot(a.ldlt().solve(b)), 1e-9 * y.squaredNorm()) << n;
  }
}

TEST(SmallCholesky, TwoEqualColumnsAreNoError) {
  MatrixXd a = MatrixXd::Ones(2, 2);
  small_cholesky(a, 2, 1e-9);
  EXPECT_TRUE(a.triangularView<Eigen::Lower>().toDenseMatrix().allFinite());
}

TEST(ShiftKernels, GramMatrixIsThatOfInnerProducts) {
  Numbers numbers(2);
  const MatrixXd a = numbers.matrix(24, 5);
  MatrixXd gram(5, 5), products(5, 5);
  gram_matrix(a.data(), 5, 24, gram.data());
  inner_products(a.data(), 5, a.data(), 5, 24, products.data());
  EXPECT_LT((gram - a.transpose() * a).norm(), 1e-12);
  EXPECT_EQ(gram, products);
}

/// A source on a grid of places beside others that stay, and p trajectories.
struct Place {
  MatrixXd source, others, data;  ///< length × grid, length × n, length × p
  double gain(Index j, bool nonnegative, double least_room) const {
    VectorXd s = source.col(j);
    if (others.cols() > 0) s -= others * others.colPivHouseholderQr().solve(s);
    Eigen::RowVectorXd products = s.transpose() * data;
    if (nonnegative) products = products.cwiseMax(0.0);
    return products.squaredNorm() / std::max(s.squaredNorm(), least_room);
  }
};

TEST(ShiftKernels, BestGainIsTheLargestOfAllPlaces) {
  constexpr Index kGrid = 32, kLength = 12;
  Numbers numbers(3);
  for (int n = 0; n <= 6; ++n) {
    for (int trial = 0; trial < 20; ++trial) {
      const Index p = 1 + trial % 3;
      const bool nonnegative = trial % 2 == 1;
      Place place{numbers.matrix(kLength, kGrid), numbers.matrix(kLength, n),
                  numbers.matrix(kLength, p)};
      place.source.colwise().normalize();
      MatrixXf factor = (place.others.transpose() * place.others).cast<float>();
      small_cholesky(factor, n, 1e-7f);
      MatrixXf weight = (place.others.transpose() * place.data).cast<float>();
      for (Index i = 0; i < p; ++i) small_forward(factor, n, weight.col(i).data());
      const MatrixXf with = (place.source.transpose() * place.others).cast<float>();
      const MatrixXf data = (place.source.transpose() * place.data).cast<float>();
      std::vector<const float*> others;
      for (Index o = 0; o < n; ++o) others.push_back(with.col(o).data());
      std::vector<float> scratch(static_cast<std::size_t>(16 * n + kGrid));
      const int start = trial % static_cast<int>(kGrid);
      const int found = best_gain({.others = others.data(),
                                   .count = n,
                                   .factor = factor.data(),
                                   .stride = std::max(1, n),
                                   .weight = weight.data(),
                                   .data = data.data(),
                                   .group = p,
                                   .grid = kGrid,
                                   .energy = 1.0f,
                                   .least_room = 1e-3f,
                                   .nonnegative = nonnegative},
                                  start, scratch.data());
      double most = 0.0;
      for (Index j = 0; j < kGrid; ++j) most = std::max(most, place.gain(j, nonnegative, 1e-3));
      EXPECT_NEAR(place.gain(found, nonnegative, 1e-3), most, 1e-4 * most) << n << ' ' << trial;
    }
  }
}

TEST(ShiftKernels, BestGainStaysWhereNothingIsBetter) {
  const std::vector<float> data(32, 0.5f);
  std::vector<float> scratch(32);
  const GainTerms terms{.others = nullptr,
                        .count = 0,
                        .factor = nullptr,
                        .stride = 1,
                        .weight = nullptr,
                        .data = data.data(),
                        .group = 1,
                        .grid = 32,
                        .energy = 1.0f,
                        .least_room = 1e-3f,
                        .nonnegative = false};
  EXPECT_EQ(best_gain(terms, 0, scratch.data()), 0);
  EXPECT_EQ(best_gain(terms, 19, scratch.data()), 19);
}

}  // namespace
}  // namespace mimesis::demix
