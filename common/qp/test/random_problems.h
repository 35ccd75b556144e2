#pragma once
#include <random>

#include "common/qp/dual_qp.h"

namespace mimesis::qp {

using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
inline constexpr double kInf = std::numeric_limits<double>::infinity();

/// A problem and the memory that it refers to.
struct OwnProblem {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
  RowMatrix A;
  Eigen::VectorXd lower, upper, x_lower, x_upper;
  Eigen::VectorXd inside;  ///< fulfils the constraints
  Problem view() const { return {H, g, A, lower, upper, x_lower, x_upper}; }
};

struct Shape {
  int n = 4, m = 6, equalities = 0;
  bool bounds = false;
  bool dependent = false;       ///< rows that others imply: copies, sums, zeros
  double conditioning = 100.0;  ///< condition number of H
};

/// Feasible by construction: all constraints hold at some point, half of them tightly.
inline OwnProblem random_problem(std::mt19937& random, const Shape& shape) {
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  const auto matrix = [&](int rows, int columns) {
    return Eigen::MatrixXd(
        Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); }));
  };
  OwnProblem p;
  Eigen::MatrixXd B = matrix(shape.n, shape.n);
  for (int i = 0; i < shape.n; ++i)
    B.col(i) *= std::pow(shape.conditioning, -0.5 * uniform(random));
  p.H = B * B.transpose() + 1.0 / shape.conditioning * Eigen::MatrixXd::Identity(shape.n, shape.n);
  p.g = 3.0 * matrix(shape.n, 1);
  p.A = matrix(shape.m, shape.n);
  if (shape.dependent) {
    for (int i = 2; i < shape.m; i += 3) {
      const int kind = i % 4;
      if (kind == 0) p.A.row(i) = p.A.row(i - 1);
      if (kind == 1) p.A.row(i) = p.A.row(i - 1) - 0.5 * p.A.row(i - 2);
      if (kind == 2) p.A.row(i) = -2.0 * p.A.row(i - 2);
      if (kind == 3) p.A.row(i).setZero();
    }
  }
  p.inside = matrix(shape.n, 1);
  const Eigen::VectorXd value = p.A * p.inside;
  p.lower = p.upper = value;
  for (int i = shape.equalities; i < shape.m; ++i) {
    const double way = uniform(random);
    p.lower[i] = way < 0.3 ? -kInf : value[i] - (way < 0.6 ? 0.0 : uniform(random));
    p.upper[i] = way > 0.8 ? kInf : value[i] + (way < 0.2 ? 0.0 : uniform(random));
  }
  if (shape.bounds) {
    p.x_lower = p.inside.array() - 0.3;
    p.x_upper = p.inside.array() + 0.2;
    for (int i = 0; i < shape.n; i += 3) p.x_lower[i] = -kInf;
  }
  return p;
}

/// How far a solution is from the conditions of Karush, Kuhn and Tucker.
struct Kkt {
  double violation = 0.0;      ///< largest violation of a constraint
  double gradient = 0.0;       ///< |Hx + g − Σ λ·row|
  double wrong_sign = 0.0;     ///< largest multiplier with a wrong sign
  double complementary = 0.0;  ///< distance of an active row from its bound
  double worst() const {
    return std::max(std::max(violation, gradient), std::max(wrong_sign, complementary));
  }
};

inline Kkt kkt(const OwnProblem& p, const DualQp& qp) {
  Kkt kkt;
  const Eigen::VectorXd x = qp.x(), Ax = p.A * x;
  const auto broken = [](double value, double lower, double upper) {
    return std::max({0.0, lower - value, value - upper});
  };
  for (int i = 0; i < Ax.size(); ++i) {
    kkt.violation = std::max(kkt.violation, broken(Ax[i], p.lower[i], p.upper[i]));
  }
  for (int i = 0; i < p.x_lower.size(); ++i) {
    kkt.violation = std::max(kkt.violation, broken(x[i], p.x_lower[i], p.x_upper[i]));
  }
  Eigen::VectorXd rest = p.H * x + p.g;
  const int m = static_cast<int>(p.A.rows());
  for (std::size_t k = 0; k < qp.active_rows().size(); ++k) {
    const int row = qp.active_rows()[k];
    const double lambda = qp.multipliers()[k];
    const bool is_row = row < m;
    if (is_row) {
      rest -= lambda * p.A.row(row).transpose();
    } else {
      rest[row - m] -= lambda;
    }
    const double value = is_row ? Ax[row] : x[row - m];
    const double lower = is_row ? p.lower[row] : p.x_lower[row - m];
    const double upper = is_row ? p.upper[row] : p.x_upper[row - m];
    const double to_lower = std::abs(value - lower), to_upper = std::abs(value - upper);
    kkt.complementary = std::max(kkt.complementary, std::min(to_lower, to_upper));
    if (lower == upper) continue;
    if (lambda > 0.0 && to_lower > to_upper) kkt.wrong_sign = std::max(kkt.wrong_sign, lambda);
    if (lambda < 0.0 && to_lower < to_upper) kkt.wrong_sign = std::max(kkt.wrong_sign, -lambda);
  }
  kkt.gradient = rest.cwiseAbs().maxCoeff();
  return kkt;
}

}  // namespace mimesis::qp
