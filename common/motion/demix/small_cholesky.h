#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

/// Factors of a few rows, once per trajectory and step: a call of Eigen's solvers costs more than
/// the work. Loops in the order of their indices: the same bits everywhere.
namespace mimesis::demix {

/// A + ridge·I → its Cholesky factor L in place of the lower triangle of the leading n×n, the
/// diagonal inverted. Pivots below `ridge` count as `ridge`.
template <class Matrix>
void small_cholesky(Matrix& a, Eigen::Index n, typename Matrix::Scalar ridge) {
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j; i < n; ++i) {
      auto sum = a(i, j);
      for (Eigen::Index q = 0; q < j; ++q) sum -= a(i, q) * a(j, q);
      if (i == j) {
        a(j, j) = 1 / std::sqrt(std::max(sum + ridge, ridge));
      } else {
        a(i, j) = sum * a(j, j);
      }
    }
  }
}

/// x ← L⁻¹x for such a factor.
template <class Matrix>
void small_forward(const Matrix& factor, Eigen::Index n, typename Matrix::Scalar* x) {
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index q = 0; q < i; ++q) x[i] -= factor(i, q) * x[q];
    x[i] *= factor(i, i);
  }
}

/// x ← L⁻ᵀL⁻¹x: solves A x = b.
template <class Matrix>
void small_solve(const Matrix& factor, Eigen::Index n, typename Matrix::Scalar* x) {
  small_forward(factor, n, x);
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    for (Eigen::Index q = i + 1; q < n; ++q) x[i] -= factor(q, i) * x[q];
    x[i] *= factor(i, i);
  }
}

}  // namespace mimesis::demix
