#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

#include "common/qp/active_set.h"

namespace mimesis::qp {

/// min ½ xᵀHx + gᵀx  subject to  lower ≤ A x ≤ upper,  x_lower ≤ x ≤ x_upper.
/// ±infinity: no bound; lower = upper: equality. Sizes n, m; bounds on x may be empty. Refers to
/// the caller's memory.
struct Problem {
  Eigen::Ref<const Eigen::MatrixXd> H;  ///< n × n, symmetric, positive definite
  Eigen::Ref<const Eigen::VectorXd> g;
  Eigen::Ref<const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> A;
  Eigen::Ref<const Eigen::VectorXd> lower, upper;      ///< m
  Eigen::Ref<const Eigen::VectorXd> x_lower, x_upper;  ///< n or 0
};

enum class Outcome {
  solved,
  infeasible,  ///< no x fulfils the constraints; `violated_row()` contradicts the others
  too_many_iterations,
  not_convex,  ///< H is not positive definite
  not_finite,  ///< NaN in the problem, or lower > upper
};
const char* name(Outcome outcome);

/// Dual active-set method [Goldfarb, Idnani, Math. Programming 27, 1983] for sequences of similar
/// dense problems: starts from the unconstrained minimum or from the active set of the last
/// solution (warm); keeps the last solution if there is no new one. Solutions fulfil their
/// constraints to 1e-10 of the terms' size. Allocates in the constructor (or for larger problems),
/// not in solve(). Deterministic.
class DualQp {
 public:
  DualQp(int most_variables, int most_rows);

  enum class Start { cold, warm };
  Outcome solve(const Problem& problem, Start start = Start::warm);

  /// Solution of the last solved problem; zeros before the first. Valid until the next solve.
  Eigen::Map<const Eigen::VectorXd> x() const {
    return {x_.data(), static_cast<Eigen::Index>(solved_n_)};
  }
  int iterations() const { return iterations_; }  ///< constraints added or dropped by the last call
  /// Constraints that hold with equality in the last solved problem: rows of A, then m + i for
  /// bound i on x; in the order of their addition. Linearly dependent ones are left out.
  std::span<const int> active_rows() const { return active_; }
  /// λ of active_rows(): Hx + g = Σ λ·row, λ ≥ 0 at a lower bound, ≤ 0 at an upper one.
  std::span<const double> multipliers() const { return multipliers_; }
  /// Row of A, or m + i for bound i on x, that contradicted the others in the last call; −1: none.
  int violated_row() const { return violated_row_; }
  void forget() { active_.clear(); }  ///< next solve is cold
  /// A limit for real time; 0: 50 + 10 (n + m).
  void limit_iterations(int most) { most_iterations_ = most; }

 private:
  struct Violation {
    int row = -1;
    double sign = 0.0, amount = 0.0;  // constraint sign·row·x ≥ sign·bound
  };
  enum class Step { added, ignored, infeasible, too_many };

  void reserve(std::size_t n, std::size_t m);
  bool load(const Problem& problem);
  Outcome begin(Start start);
  bool try_add(int row, double sign);
  Violation worst();
  Step add(Violation violation);
  void drop(std::size_t position);
  void settle();
  void keep_multipliers_right();
  void polish();
  void accept();

  double side(int row, double sign) const {
    return sign > 0.0 ? lower_[static_cast<std::size_t>(row)]
                      : upper_[static_cast<std::size_t>(row)];
  }
  const double* normal(int row, double sign);
  double value(int row) const;  ///< row · x
  double scale(int row) const;  ///< size of the terms that make it up

  ActiveSet set_;
  std::size_t n_ = 0, m_ = 0, rows_ = 0;  // rows_: m and the bounds on x
  std::vector<double> A_, norm_;          // m padded rows, and their lengths
  std::vector<double> lower_, upper_;     // limits of rows and bounds
  std::vector<char> taken_;               // active or, till the next drop, redundant
  std::vector<int> working_;              // active rows
  std::vector<double> sign_, u_, side_;   // signs, multipliers and sides of working_
  std::vector<double> g_, work_x_, value_, normal_, residual_;
  std::size_t equalities_ = 0;  // the first of working_
  double x_size_ = 0.0;
  int most_iterations_ = 0;

  std::vector<double> x_, multipliers_;
  std::vector<int> active_;
  std::vector<int> wanted_;  // the last active set, while a warm start adds it
  std::size_t solved_n_ = 0;
  int iterations_ = 0, violated_row_ = -1;
};

}  // namespace mimesis::qp
