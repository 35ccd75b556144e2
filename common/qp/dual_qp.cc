#include "common/qp/dual_qp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/qp/kernels.h"

namespace mimesis::qp {

namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
// Tolerated violation, relative to the size of the row's terms.
constexpr double kTight = 1e-12;
// Tolerance for a row that depends on the active ones and carries their rounding.
constexpr double kLoose = 1e-10;

}  // namespace

DualQp::DualQp(int most_variables, int most_rows) {
  MIMESIS_ASSERT(most_variables > 0 && most_rows >= 0);
  reserve(static_cast<std::size_t>(most_variables), static_cast<std::size_t>(most_rows));
  solved_n_ = static_cast<std::size_t>(most_variables);
}

Outcome DualQp::solve(const Problem& problem, Start start) {
  const auto n = static_cast<std::size_t>(problem.g.size());
  MIMESIS_ASSERT(problem.H.rows() == problem.g.size() && problem.H.cols() == problem.g.size());
  reserve(n, static_cast<std::size_t>(problem.A.rows()));
  iterations_ = 0;
  violated_row_ = -1;
  if (!problem.H.allFinite()) return Outcome::not_finite;
  if (!set_.factor(problem.H.data(), static_cast<std::size_t>(problem.H.outerStride()), n)) {
    return Outcome::not_convex;
  }
  n_ = n;
  if (!load(problem)) return Outcome::not_finite;
  if (const Outcome outcome = begin(start); outcome != Outcome::solved) return outcome;
  for (bool polished = set_.size() == 0;;) {
    const Violation violation = worst();
    if (violation.row < 0) {
      if (polished) {
        accept();
        return Outcome::solved;
      }
      settle();
      polished = true;
      continue;
    }
    polished = false;
    switch (add(violation)) {
      case Step::added:
      case Step::ignored:
        break;
      case Step::infeasible:
        violated_row_ = violation.row;
        return Outcome::infeasible;
      case Step::too_many:
        violated_row_ = violation.row;
        return Outcome::too_many_iterations;
    }
  }
}

/// The minimum on the equalities and as much of the last active set as pulls the right way.
Outcome DualQp::begin(Start start) {
  wanted_.assign(active_.begin(), active_.end());
  set_.clear();
  working_.clear();
  sign_.clear();
  u_.clear();
  std::fill_n(taken_.data(), rows_, 0);
  for (std::size_t i = 0; i < rows_; ++i) {
    if (lower_[i] == upper_[i]) try_add(static_cast<int>(i), 1.0);
  }
  equalities_ = working_.size();
  if (start == Start::warm) {
    for (std::size_t k = 0; k < wanted_.size(); ++k) {
      const auto row = static_cast<std::size_t>(wanted_[k]);
      const double sign = multipliers_[k] < 0.0 ? -1.0 : 1.0;
      if (row >= rows_ || taken_[row] || lower_[row] == upper_[row]) continue;
      if (std::isfinite(side(wanted_[k], sign))) try_add(wanted_[k], sign);
    }
  }
  settle();
  for (std::size_t i = 0; i < rows_; ++i) {  // equalities that others imply
    if (lower_[i] != upper_[i]) continue;
    const int row = static_cast<int>(i);
    if (std::abs(value(row) - lower_[i]) > kLoose * (scale(row) + std::abs(lower_[i]))) {
      violated_row_ = row;
      return Outcome::infeasible;
    }
    taken_[i] = 1;
  }
  return Outcome::solved;
}

/// Makes a row active without a step.
bool DualQp::try_add(int row, double sign) {
  if (set_.size() == n_) return false;
  if (static_cast<std::size_t>(row) < m_) {
    set_.look_at(normal(row, sign));
  } else {
    set_.look_at_axis(static_cast<std::size_t>(row) - m_, sign);
  }
  if (!set_.independent()) return false;
  set_.find_step();
  set_.add();
  working_.push_back(row);
  sign_.push_back(sign);
  u_.push_back(0.0);
  taken_[static_cast<std::size_t>(row)] = 1;
  return true;
}

/// The minimum on the active set, less those constraints that pull the wrong way. Any active set
/// whose multipliers are right is a start for the dual method.
void DualQp::settle() {
  for (;;) {
    polish();
    double largest = 0.0;
    std::size_t least = equalities_;
    for (std::size_t k = equalities_; k < u_.size(); ++k) {
      largest = std::max(largest, u_[k]);
      if (u_[k] < u_[least]) least = k;
    }
    if (least >= u_.size() || u_[least] >= -kTight * largest) break;
    drop(least);
    ++iterations_;
  }
  keep_multipliers_right();
}

void DualQp::keep_multipliers_right() {  // multipliers may be negative by rounding
  for (std::size_t k = equalities_; k < u_.size(); ++k) u_[k] = std::max(u_[k], 0.0);
}

/// Recomputes x and u from the active set, so that the rounding of the steps does not stay.
void DualQp::polish() {
  const std::size_t q = working_.size();
  side_.resize(q);
  residual_.resize(q);
  for (std::size_t k = 0; k < q; ++k) side_[k] = sign_[k] * side(working_[k], sign_[k]);
  set_.minimum(g_.data(), side_.data(), work_x_.data(), u_.data());
  x_size_ = 0.0;
  for (std::size_t i = 0; i < n_; ++i) x_size_ = std::max(x_size_, std::abs(work_x_[i]));
  if (q == 0) return;
  for (std::size_t k = 0; k < q; ++k) residual_[k] = side_[k] - sign_[k] * value(working_[k]);
  set_.correct(residual_.data(), work_x_.data());
}

/// The constraint that x breaks most, by the distance of x from it.
DualQp::Violation DualQp::worst() {
  dots(A_.data(), set_.stride(), m_, work_x_.data(), value_.data());
  std::copy_n(work_x_.data(), rows_ - m_, value_.data() + m_);
  x_size_ = 0.0;
  for (std::size_t i = 0; i < n_; ++i) x_size_ = std::max(x_size_, std::abs(work_x_[i]));
  // A solve that takes this long is cycling in its own rounding.
  const double tolerance =
      static_cast<std::size_t>(iterations_) > 20 + n_ + rows_ ? kLoose : kTight;
  Violation worst;
  double most = 0.0;
  for (std::size_t i = 0; i < rows_; ++i) {
    const double below = lower_[i] - value_[i], above = value_[i] - upper_[i];
    const double amount = below > above ? below : above;
    if (!(amount > 0.0) || taken_[i]) continue;
    const double norm = i < m_ ? norm_[i] : 1.0;
    const double bound = std::abs(below > above ? lower_[i] : upper_[i]);
    if (amount <= tolerance * (norm * x_size_ + bound)) continue;
    const double distance = norm > 0.0 ? amount / norm : kInf;
    if (distance <= most) continue;
    most = distance;
    worst = {static_cast<int>(i), below > above ? 1.0 : -1.0, amount};
  }
  return worst;
}

/// Steps in x and u until the constraint holds; drops constraints whose multipliers vanish.
DualQp::Step DualQp::add(Violation violation) {
  const int row = violation.row,
            most = most_iterations_ > 0 ? most_iterations_ : 50 + 10 * static_cast<int>(rows_ + n_);
  const double bound = violation.sign * side(row, violation.sign);
  const bool is_row = static_cast<std::size_t>(row) < m_;
  const double* a = is_row ? normal(row, violation.sign) : nullptr;
  double u_new = 0.0, missing = violation.amount;
  for (;;) {
    if (iterations_++ >= most) return Step::too_many;
    if (is_row) {
      set_.look_at(a);
    } else {
      set_.look_at_axis(static_cast<std::size_t>(row) - m_, violation.sign);
    }
    if (!set_.independent() && missing <= kLoose * (scale(row) + std::abs(bound))) {
      if (u_new > 0.0) settle();
      taken_[static_cast<std::size_t>(row)] = 1;
      return Step::ignored;
    }
    const double* r = set_.dual_step();
    double t_dual = kInf;
    std::size_t leaves = 0;
    for (std::size_t k = equalities_; k < u_.size(); ++k) {
      if (r[k] > 0.0 && u_[k] < t_dual * r[k]) t_dual = u_[k] / r[k], leaves = k;
    }
    const double t_primal = set_.independent() ? missing / set_.curvature() : kInf;
    const double t = std::min(t_dual, t_primal);
    if (t == kInf) return Step::infeasible;
    for (std::size_t k = 0; k < u_.size(); ++k) u_[k] -= t * r[k];
    keep_multipliers_right();
    u_new += t;
    if (set_.independent()) {
      set_.find_step();
      const double* z = set_.step();
      for (std::size_t i = 0; i < n_; ++i) work_x_[i] += t * z[i];
    }
    if (t_primal <= t_dual) break;
    drop(leaves);
    missing = std::max(0.0, bound - violation.sign * value(row));
  }
  set_.add();
  working_.push_back(row);
  sign_.push_back(violation.sign);
  u_.push_back(u_new);
  taken_[static_cast<std::size_t>(row)] = 1;
  return Step::added;
}

void DualQp::drop(std::size_t position) {
  set_.drop(position);
  const auto at = static_cast<std::ptrdiff_t>(position);
  working_.erase(working_.begin() + at);
  sign_.erase(sign_.begin() + at);
  u_.erase(u_.begin() + at);
  // Rows that the active ones implied may be implied no longer.
  std::fill_n(taken_.data(), rows_, 0);
  for (const int row : working_) taken_[static_cast<std::size_t>(row)] = 1;
  for (std::size_t i = 0; i < rows_; ++i) {
    if (lower_[i] == upper_[i]) taken_[i] = 1;
  }
}

// The problem as the method sees it: padded rows, bounds on x behind them, and the solution kept.
const char* name(Outcome outcome) {
  constexpr std::array kNames = {"solved", "infeasible", "too many iterations", "not convex",
                                 "not finite"};
  return kNames.at(static_cast<std::size_t>(outcome));
}

void DualQp::reserve(std::size_t n, std::size_t m) {
  const std::size_t stride = padded(n);
  if (x_.size() < stride) {
    set_.reserve(n);
    for (auto* v : {&g_, &work_x_, &normal_, &x_}) v->resize(stride, 0.0);
    for (auto* v : {&u_, &sign_, &side_, &residual_, &multipliers_}) v->reserve(stride);
    for (auto* v : {&working_, &active_, &wanted_}) v->reserve(stride);
  }
  if (norm_.size() < m) norm_.resize(m);
  if (A_.size() < stride * m) A_.resize(stride * m);
  if (lower_.size() < m + n) {
    for (auto* v : {&lower_, &upper_, &value_}) v->resize(m + n);
    taken_.resize(m + n);
  }
}

/// Copies rows and bounds. @return false if they are no numbers or contradict themselves.
bool DualQp::load(const Problem& problem) {
  m_ = static_cast<std::size_t>(problem.A.rows());
  const bool bounded = problem.x_lower.size() > 0 || problem.x_upper.size() > 0;
  rows_ = m_ + (bounded ? n_ : 0);
  MIMESIS_ASSERT(m_ == 0 || static_cast<std::size_t>(problem.A.cols()) == n_);
  MIMESIS_ASSERT(static_cast<std::size_t>(problem.lower.size()) == m_ &&
                 static_cast<std::size_t>(problem.upper.size()) == m_);
  MIMESIS_ASSERT(problem.x_lower.size() == problem.x_upper.size());
  MIMESIS_ASSERT(!bounded || static_cast<std::size_t>(problem.x_lower.size()) == n_);
  const std::size_t stride = set_.stride();
  std::copy_n(problem.g.data(), n_, g_.data());
  std::fill(g_.begin() + static_cast<std::ptrdiff_t>(n_), g_.end(), 0.0);
  for (auto* v : {&work_x_, &normal_}) std::fill(v->begin(), v->end(), 0.0);
  for (std::size_t i = 0; i < m_; ++i) {
    double* to = A_.data() + i * stride;
    std::copy_n(problem.A.data() + static_cast<std::ptrdiff_t>(i) * problem.A.outerStride(), n_,
                to);
    std::fill(to + n_, to + stride, 0.0);
    dots(to, stride, 1, to, &norm_[i]);
    norm_[i] = std::sqrt(norm_[i]);
    if (!std::isfinite(norm_[i])) return violated_row_ = static_cast<int>(i), false;
  }
  std::copy_n(problem.lower.data(), m_, lower_.data());
  std::copy_n(problem.upper.data(), m_, upper_.data());
  if (bounded) {
    std::copy_n(problem.x_lower.data(), n_, lower_.data() + m_);
    std::copy_n(problem.x_upper.data(), n_, upper_.data() + m_);
  }
  for (std::size_t i = 0; i < rows_; ++i) {
    if (!(lower_[i] <= upper_[i]) || lower_[i] == kInf || upper_[i] == -kInf) {
      return violated_row_ = static_cast<int>(i), false;
    }
  }
  return problem.g.allFinite();
}

const double* DualQp::normal(int row, double sign) {
  const double* from = A_.data() + static_cast<std::size_t>(row) * set_.stride();
  for (std::size_t i = 0; i < n_; ++i) normal_[i] = sign * from[i];
  return normal_.data();
}

double DualQp::value(int row) const {
  const auto i = static_cast<std::size_t>(row);
  if (i >= m_) return work_x_[i - m_];
  double sum = 0.0;
  dots(A_.data() + i * set_.stride(), set_.stride(), 1, work_x_.data(), &sum);
  return sum;
}

double DualQp::scale(int row) const {
  const auto i = static_cast<std::size_t>(row);
  return (i >= m_ ? 1.0 : norm_[i]) * x_size_;
}

void DualQp::accept() {
  std::copy_n(work_x_.data(), n_, x_.data());
  solved_n_ = n_;
  active_.assign(working_.begin(), working_.end());
  multipliers_.resize(working_.size());
  for (std::size_t k = 0; k < working_.size(); ++k) multipliers_[k] = sign_[k] * u_[k];
}

}  // namespace mimesis::qp
