#pragma once
#include <Eigen/Core>
#include <vector>

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
  Cascade(int n, int most_rows, int most_levels, double damping);

  void clear();
  void begin_level();
  /// Adds a row to the present level; the row depends on x. `weight` counts within the level.
  void add_row(const Eigen::Ref<const Eigen::RowVectorXd, 0, Eigen::InnerStride<>>& row,
               double weight);
  void add_axis(int i, double weight);  ///< adds the row eᵢ, which does not depend on x
  int rows() const { return rows_; }
  int free() const { return n_ - static_cast<int>(basis_.size()); }  ///< undecided coordinates

  /// `b`: right-hand side of all rows, unweighted. @return false, x unchanged, if a program failed.
  bool solve(const Eigen::Ref<const Eigen::VectorXd>& b,
             const Eigen::Ref<const Eigen::VectorXd>& lower,
             const Eigen::Ref<const Eigen::VectorXd>& upper, Eigen::Ref<Eigen::VectorXd> x);

  /// Residuals of the last solve damp the next ones: where a residual r remains, Newton steps
  /// longer than r's curvature allows oscillate [Levenberg, Marquardt; Sugihara 2011]. The first
  /// level is damped only within bounds.
  void remember_residuals();
  void forget_residuals();

  bool bounded() const { return bounded_; }  ///< a bound affected the last solve
  /// Largest |Ax − b| of the first level's rows in the last solve, unweighted.
  double first_residual() const { return first_residual_; }
  /// b − Ax of all rows in the last solve, unweighted.
  void residual(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> out) const;
  qp::Outcome outcome() const { return outcome_; }

 private:
  struct Level {
    int row = 0, column = 0;  // first
    int rows = 0, columns = 0;
    bool square = true;  // every row has added a coordinate, well away from the others
    double damping_squared = 0.0, unreached = 0.0;
  };
  void place(double weight, double length);
  void close_levels();
  void right_side(const Level& level);
  void solve_free(const Level& level, double damping_squared);
  void normal_equations(const Level& level, double damping_squared);
  bool solve_levels_bounded(const Eigen::Ref<const Eigen::VectorXd>& lower,
                            const Eigen::Ref<const Eigen::VectorXd>& upper);
  bool solve_bounded(const Level& level, int depth, const Eigen::Ref<const Eigen::VectorXd>& lower,
                     const Eigen::Ref<const Eigen::VectorXd>& upper);
  void compose();

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
