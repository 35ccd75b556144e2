#pragma once
#include <Eigen/Core>
#include <span>
#include <vector>

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
  kSolved,
  kInfeasible,  ///< no x fulfils the constraints; `violated_row()` is one that contradicts
  kTooManyIterations,
  kNotConvex,  ///< H is not positive definite
  kNotFinite,  ///< NaN in the problem, or lower > upper
};
const char* name(Outcome outcome);

/// Dual active-set method [Goldfarb, Idnani, Math. Programming 27, 1983] for dense problems that
/// come again and again: starts from the unconstrained minimum or from the active set of the last
/// solution (warm), keeps the last solution if there is none. Allocates when it is made (or asked
/// for larger problems), not in solve(). Deterministic.
class DualQp {
 public:
  DualQp(int most_variables, int most_rows);

  enum class Start { kCold, kWarm };
  Outcome solve(const Problem& problem, Start start = Start::kWarm);
  /// H is that of the last problem: its factor is used again. Precondition: a problem of that size
  /// was solved before.
  Outcome solve_same_hessian(const Problem& problem, Start start = Start::kWarm);

  const Eigen::VectorXd& x() const { return x_; }  ///< of the last solved problem
  double objective() const { return objective_; }
  int iterations() const { return iterations_; }
  std::span<const int> active_rows() const;           ///< of A, in the order of their addition
  int violated_row() const { return violated_row_; }  ///< of A; n bounds follow as m + i
  void forget() {                                     /* helper: next solve is cold */
  }

 private:
  Eigen::VectorXd x_;
  double objective_ = 0.0;
  int iterations_ = 0, violated_row_ = -1;
  // helper
};

}  // namespace mimesis::qp
