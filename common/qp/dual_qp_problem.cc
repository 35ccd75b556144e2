// The problem as the method sees it: padded rows, bounds on x behind them, and the solution kept.
#include <algorithm>
#include <cmath>
#include <limits>

#include "common/error.h"
#include "common/qp/dual_qp.h"
#include "common/qp/kernels.h"

namespace mimesis::qp {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();

}  // namespace

const char* name(Outcome outcome) {
  switch (outcome) {
    case Outcome::kSolved:
      return "solved";
    case Outcome::kInfeasible:
      return "infeasible";
    case Outcome::kTooManyIterations:
      return "too many iterations";
    case Outcome::kNotConvex:
      return "not convex";
    case Outcome::kNotFinite:
      return "not finite";
  }
  return "unknown";
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

Outcome DualQp::accept(const Problem& problem) {
  std::copy_n(work_x_.data(), n_, x_.data());
  solved_n_ = n_;
  active_.assign(working_.begin(), working_.end());
  multipliers_.resize(working_.size());
  for (std::size_t k = 0; k < working_.size(); ++k) multipliers_[k] = sign_[k] * u_[k];
  const auto solution = x();
  double squared = 0.0;
  for (Eigen::Index j = 0; j < solution.size(); ++j) {
    squared += solution[j] * problem.H.col(j).dot(solution);
  }
  objective_ = 0.5 * squared + problem.g.dot(solution);
  return Outcome::kSolved;
}

}  // namespace mimesis::qp
