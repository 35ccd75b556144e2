#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/error.h"
#include "common/qp/active_set.h"
#include "common/qp/dual_qp.h"

namespace mimesis::walker {

/// Lexicographic least squares under bounds [Escande, Mansard, Wieber 2014]: finds x in lower ≤ x ≤
/// upper that minimises |A₁x − b₁|, among these |A₂x − b₂|, and so on, and last |x|.
///
/// The rows of all levels build an orthogonal basis Y of the x space in which they are a lower
/// trapezoid, A Y = L: level k decides the coordinates that its rows have added and touches none of
/// those above [Mansard 2009]. Levels without an active bound are solved by substitution. A level
/// that a bound affects is a quadratic program in its own coordinates and all lower ones, which
/// cost nothing and make room within the bounds.
///
/// Rows are kept from one solve to the next, for several right-hand sides. Allocates only in the
/// constructor. Deterministic.
class Cascade {
 public:
  Cascade(int n, int most_rows, int most_levels, double damping)
      : n_(n),
        damping_(damping),
        L_(most_rows, n),
        weight_(most_rows),
        slope_(most_rows),
        bends_(static_cast<std::size_t>(most_rows)),
        unreached_(static_cast<std::size_t>(most_levels) + 1),
        row_(Eigen::VectorXd::Zero(n + 4)),
        b_(most_rows),
        rest_(most_rows),
        z_(n),
        x_(n + 4),
        factor_side_(n),
        normal_(n, n),
        Y_(n, n),
        H_(n, n),
        g_(n),
        fixed_(n + 4),
        least_(n),
        most_(n) {
    basis_.reserve(static_cast<std::size_t>(n));
    basis_.factor_identity(static_cast<std::size_t>(n));
    levels_.reserve(static_cast<std::size_t>(most_levels) + 1);
    for (int i = 0; i <= most_levels; ++i) programs_.emplace_back(n, n);
    clear();
  }

  void clear() {
    basis_.clear();
    levels_.clear();
    rows_ = 0;
  }
  void begin_level() {
    levels_.push_back({.row = rows_, .column = static_cast<int>(basis_.size())});
  }
  /// Adds a row to the present level; the row depends on x. `weight` counts within the level.
  void add_row(const Eigen::Ref<const Eigen::RowVectorXd, 0, Eigen::InnerStride<>>& row,
               double weight) {
    MIMESIS_ASSERT(row.size() == n_ && rows_ < L_.rows() && !levels_.empty());
    row_.head(n_) = row.transpose();
    basis_.look_at(row_.data());
    bends_[static_cast<std::size_t>(rows_)] = true;
    place(weight, row_.head(n_).norm());
  }
  /// adds the row eᵢ, which does not depend on x
  void add_axis(int i, double weight) {
    MIMESIS_ASSERT(i >= 0 && i < n_ && rows_ < L_.rows() && !levels_.empty());
    basis_.look_at_axis(static_cast<std::size_t>(i), 1.0);
    bends_[static_cast<std::size_t>(rows_)] = false;
    place(weight, 1.0);
  }
  int rows() const { return rows_; }
  int free() const { return n_ - static_cast<int>(basis_.size()); }  ///< undecided coordinates

  /// `b`: right-hand side of all rows, unweighted. @return false, x unchanged, if a program failed.
  bool solve(const Eigen::Ref<const Eigen::VectorXd>& b,
             const Eigen::Ref<const Eigen::VectorXd>& lower,
             const Eigen::Ref<const Eigen::VectorXd>& upper, Eigen::Ref<Eigen::VectorXd> x) {
    MIMESIS_ASSERT(b.size() == rows_ && lower.size() == n_ && upper.size() == n_ && x.size() == n_);
    b_.head(rows_) = b.cwiseProduct(weight_.head(rows_));
    close_levels();
    outcome_ = qp::Outcome::solved;
    z_.setZero();
    for (const Level& level : levels_) {
      solve_free(level, level.damping_squared + (level.column > 0 ? level.unreached : 0.0));
    }
    compose();
    bounded_ = ((x_.head(n_) - upper).array() > kOnBound).any() ||
               ((lower - x_.head(n_)).array() > kOnBound).any();
    if (bounded_ && !solve_levels_bounded(lower, upper)) return false;
    x = x_.head(n_).cwiseMin(upper).cwiseMax(lower);
    first_residual_ = 0.0;
    if (levels_.empty()) return true;
    for (int i = 0; i < levels_[0].rows; ++i) {
      const double rest = L_.row(i).dot(z_) - b_[i];
      first_residual_ = std::max(first_residual_, std::abs(rest) / weight_[i]);
    }
    return true;
  }

  /// Residuals of the last solve damp the next ones: where a residual r remains, Newton steps
  /// longer than r's curvature allows oscillate [Levenberg, Marquardt; Sugihara 2011]. The first
  /// level is damped only within bounds.
  void remember_residuals() {
    for (std::size_t k = 0; k < levels_.size(); ++k) {
      const Level& level = levels_[k];
      double sum = 0.0;
      for (int i = level.row; i < level.row + level.rows; ++i) {
        if (!bends_[static_cast<std::size_t>(i)]) continue;
        const double rest = std::abs(b_[i] - L_.row(i).dot(z_));
        sum += weight_[i] * rest;
      }
      unreached_[k] = sum > kReached ? kCurvature * sum : 0.0;
    }
  }
  void forget_residuals() { std::ranges::fill(unreached_, 0.0); }

  bool bounded() const { return bounded_; }  ///< a bound affected the last solve
  /// Largest |Ax − b| of the first level's rows in the last solve, unweighted.
  double first_residual() const { return first_residual_; }
  /// b − Ax of all rows in the last solve, unweighted.
  void residual(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> out) const {
    for (int i = 0; i < rows_; ++i) out[i] = b[i] - L_.row(i).dot(z_) / weight_[i];
  }
  qp::Outcome outcome() const { return outcome_; }

 private:
  using Index = Eigen::Index;
  // Sine of the angle between a row and those before it below which the level is damped.
  static constexpr double kNearlySingular = 0.02;
  // Cost of the coordinates of lower levels, against 1 for a row: nearly nothing, but the program
  // is strictly convex.
  static constexpr double kPrice = 1e-8;
  // The bounds of a level are wider than those of the level above by this share of the widest
  // bound, so that rounding above (DualQp: 1e-10) does not leave the lower level without a
  // solution.
  static constexpr double kWider = 2e-10;
  static constexpr double kOnBound = 1e-12;
  // Second derivative of a position by joints, about an arm's or a leg's length [m].
  static constexpr double kCurvature = 0.5;
  static constexpr double kReached = 1e-8;  // [m], [rad]: rounding

  struct Level {
    int row = 0, column = 0;  // first
    int rows = 0, columns = 0;
    bool square = true;  // every row has added a coordinate, well away from the others
    double damping_squared = 0.0, unreached = 0.0;
  };
  /// Writes the last row in the decided coordinates, adding a coordinate if the row is linearly
  /// independent of the others.
  void place(double weight, double length) {
    Level& level = levels_.back();
    auto row = L_.row(rows_);
    const double scale = std::sqrt(weight);
    const bool adds = static_cast<int>(basis_.size()) < n_ && basis_.independent() && length > 0.0;
    if (adds) {
      basis_.find_step();
      basis_.add();
    }
    const auto decided = static_cast<Index>(basis_.size());
    row.setZero();
    row.head(decided) = scale * Eigen::Map<const Eigen::RowVectorXd>(basis_.coordinates(), decided);
    weight_[rows_] = scale;
    slope_[rows_] = adds ? std::abs(row[decided - 1]) / (scale * length) : 1.0;
    level.square = level.square && adds;
    ++level.rows;
    ++rows_;
    level.columns = static_cast<int>(decided) - level.column;
  }
  /// Sets each level's damping by how close it is to singular [Nakamura, Hanafusa 1986]: none down
  /// to kNearlySingular, all of it where rows coincide.
  void close_levels() {
    for (Level& level : levels_) {
      const double least = level.rows > 0 ? slope_.segment(level.row, level.rows).minCoeff() : 1.0;
      const double ratio = std::min(1.0, least / kNearlySingular);
      level.damping_squared = damping_ * damping_ * (1.0 - ratio * ratio);
      level.unreached = unreached_[static_cast<std::size_t>(&level - levels_.data())];
    }
  }
  /// rest_ = b − L z for the level's rows and the coordinates that the levels above have decided.
  void right_side(const Level& level) {
    const auto rows = L_.middleRows(level.row, level.rows);
    auto rest = rest_.head(level.rows);
    rest = b_.segment(level.row, level.rows);
    rest.noalias() -= rows.leftCols(level.column) * z_.head(level.column);
  }
  /// Solves for the level's own coordinates without bounds: by substitution, or damped.
  void solve_free(const Level& level, double damping_squared) {
    if (level.columns == 0) return;
    right_side(level);
    auto z = z_.segment(level.column, level.columns);
    if (level.square && damping_squared == 0.0) {
      for (int i = 0; i < level.rows; ++i) {
        const auto row = L_.row(level.row + i).segment(level.column, i + 1);
        z[i] = (rest_[i] - row.head(i).dot(z.head(i))) / row[i];
      }
      return;
    }
    normal_equations(level, damping_squared);
    auto H = normal_.topLeftCorner(level.columns, level.columns);
    z = factor_side_.head(level.columns);
    // Cholesky and substitution in place.
    for (int j = 0; j < level.columns; ++j) {
      const double pivot = std::sqrt(H(j, j) - H.row(j).head(j).squaredNorm());
      H(j, j) = pivot;
      for (int i = j + 1; i < level.columns; ++i) {
        H(i, j) = (H(i, j) - H.row(i).head(j).dot(H.row(j).head(j))) / pivot;
      }
    }
    for (int i = 0; i < level.columns; ++i) {
      z[i] = (z[i] - H.row(i).head(i).dot(z.head(i))) / H(i, i);
    }
    for (int i = level.columns; i-- > 0;) {
      const int below = level.columns - i - 1;
      z[i] = (z[i] - H.col(i).tail(below).dot(z.tail(below))) / H(i, i);
    }
  }
  /// normal_ = SᵀS + damping², factor_side_ = Sᵀ rest_, S: the level's rows in its own coordinates.
  void normal_equations(const Level& level, double damping_squared) {
    const auto S = L_.block(level.row, level.column, level.rows, level.columns);
    auto H = normal_.topLeftCorner(level.columns, level.columns);
    H.noalias() = S.transpose().lazyProduct(S);
    H.diagonal().array() += damping_squared;
    factor_side_.head(level.columns).noalias() = S.transpose().lazyProduct(rest_.head(level.rows));
  }
  /// Solves all levels within the bounds, then minimises |x| in the rest. @return false if the
  /// first level has no solution.
  bool solve_levels_bounded(const Eigen::Ref<const Eigen::VectorXd>& lower,
                            const Eigen::Ref<const Eigen::VectorXd>& upper) {
    for (int i = 0; i < n_; ++i) {
      Y_.col(i) = Eigen::Map<const Eigen::VectorXd>(
          basis_.basis() + static_cast<std::size_t>(i) * basis_.stride(), n_);
    }
    z_.setZero();
    wider_ = 0.0;
    for (int i = 0; i < n_; ++i) {
      for (const double bound : {lower[i], upper[i]}) {
        if (std::isfinite(bound)) wider_ = std::max(wider_, kWider * std::abs(bound));
      }
    }
    int depth = 0;
    for (const Level& level : levels_) {
      if (!solve_bounded(level, depth++, lower, upper)) {
        if (depth == 1) return false;
        break;  // the level above has a solution of its own
      }
    }
    const Level left{.row = rows_, .column = static_cast<int>(basis_.size())};
    if (outcome_ == qp::Outcome::solved) solve_bounded(left, depth, lower, upper);
    compose();
    return true;
  }
  /// Solves the level with all lower coordinates, within the bounds. Without rows: minimises |x|.
  bool solve_bounded(const Level& level, int depth, const Eigen::Ref<const Eigen::VectorXd>& lower,
                     const Eigen::Ref<const Eigen::VectorXd>& upper) {
    const int n = n_ - level.column, own = level.columns;
    if (n == 0 || (own == 0 && level.rows > 0)) return true;
    const double damping_squared = level.damping_squared + level.unreached;
    const auto Y = Y_.rightCols(n);
    auto fixed = fixed_.head(n_);
    fixed.noalias() = Y_.leftCols(level.column) * z_.head(level.column);
    least_ = lower.array() - fixed.array() - wider_ * depth;
    most_ = upper.array() - fixed.array() + wider_ * depth;
    // No bound in the way of the level and of those above: the program's minimum is known.
    z_.tail(n).setZero();
    solve_free(level, damping_squared);
    fixed.noalias() = Y.leftCols(own) * z_.segment(level.column, own);
    if ((fixed.array() <= most_.array()).all() && (fixed.array() >= least_.array()).all()) {
      return true;
    }

    auto H = H_.topLeftCorner(n, n);
    auto g = g_.head(n);
    H.setZero();
    g.setZero();
    H.diagonal().setConstant(level.rows > 0 ? kPrice : 1.0);
    if (own > 0) {
      normal_equations(level, damping_squared);
      H.topLeftCorner(own, own) = normal_.topLeftCorner(own, own);
      g.head(own) = -factor_side_.head(own);
    }
    qp::DualQp& program = programs_[static_cast<std::size_t>(depth)];
    outcome_ = program.solve({H, g, Y, least_, most_, none_, none_});
    if (outcome_ != qp::Outcome::solved) return false;
    z_.tail(n) = program.x();
    return true;
  }
  void compose() {
    x_.setZero();
    for (int i = 0; i < n_; ++i) {
      const double* column = basis_.basis() + static_cast<std::size_t>(i) * basis_.stride();
      x_.head(n_) += z_[i] * Eigen::Map<const Eigen::VectorXd>(column, n_);
    }
  }

  int n_, rows_ = 0;
  double damping_;
  qp::ActiveSet basis_;
  std::vector<Level> levels_;
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> L_;  // weighted
  Eigen::VectorXd weight_, slope_;  // per row: √weight; new diagonal element against its length
  std::vector<bool> bends_;         // per row
  std::vector<double> unreached_;   // per level: damping for the next solves
  Eigen::VectorXd row_, b_, rest_, z_, x_, factor_side_;
  Eigen::MatrixXd normal_;
  // Bounded levels
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> Y_;
  Eigen::MatrixXd H_;
  Eigen::VectorXd g_, fixed_, least_, most_, none_;
  std::vector<qp::DualQp> programs_;

  double wider_ = 0.0;  // widening of the bounds, per level
  bool bounded_ = false;
  double first_residual_ = 0.0;
  qp::Outcome outcome_ = qp::Outcome::solved;
};

}  // namespace mimesis::walker
