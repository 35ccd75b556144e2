#include "common/qp/active_set.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "common/qp/kernels.h"

namespace mimesis::qp {
namespace {

// Sine of the angle between a normal and the active ones' span below which it counts as one of
// them, in the metric of H.
constexpr double kDependent = 1e-10;

double dot(const double* a, const double* b, std::size_t n) {
  double sum = 0.0;
  for (std::size_t i = 0; i < n; ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

void ActiveSet::reserve(std::size_t n) {
  if (n <= most_) return;
  most_ = n;
  const std::size_t stride = padded(n);
  for (auto* matrix : {&J0_, &J_, &R_, &scratch_}) matrix->assign(stride * n, 0.0);
  for (auto* vector : {&d_, &z_, &r_, &y_}) vector->assign(stride, 0.0);
}

bool ActiveSet::factor(const double* hessian, std::size_t outer, std::size_t n) {
  n_ = n;
  stride_ = padded(n);
  for (std::size_t j = 0; j < n; ++j) {
    double* to = scratch_.data() + j * stride_;
    std::memcpy(to, hessian + j * outer, sizeof(double) * n);
    std::fill(to + n, to + stride_, 0.0);
  }
  for (auto* vector : {&d_, &z_, &r_, &y_}) std::fill(vector->begin(), vector->end(), 0.0);
  return invert_cholesky(scratch_.data(), stride_, n, J0_.data());
}

void ActiveSet::factor_identity(std::size_t n) {
  n_ = n;
  stride_ = padded(n);
  for (auto* vector : {&d_, &z_, &r_, &y_}) std::fill(vector->begin(), vector->end(), 0.0);
  std::fill_n(J0_.data(), stride_ * n, 0.0);
  for (std::size_t i = 0; i < n; ++i) J0_[i * stride_ + i] = 1.0;
}

void ActiveSet::clear() {
  q_ = 0;
  std::memcpy(J_.data(), J0_.data(), sizeof(double) * stride_ * n_);
}

void ActiveSet::look_at(const double* normal) {
  dots(J_.data(), stride_, n_, normal, d_.data());
  judge();
}

void ActiveSet::look_at_axis(std::size_t i, double sign) {
  for (std::size_t j = 0; j < n_; ++j) d_[j] = sign * J_[j * stride_ + i];
  judge();
}

void ActiveSet::judge() {
  free_squared_ = dot(d_.data() + q_, d_.data() + q_, n_ - q_);
  const double taken_squared = dot(d_.data(), d_.data(), q_);
  independent_ = free_squared_ > kDependent * kDependent * (free_squared_ + taken_squared);
}

void ActiveSet::find_step() {
  std::fill_n(z_.data(), stride_, 0.0);
  add_columns(column(q_), stride_, n_ - q_, d_.data() + q_, z_.data());
}

const double* ActiveSet::dual_step() {
  std::copy_n(d_.data(), q_, r_.data());
  solve(r_.data());
  return r_.data();
}

void ActiveSet::add() {
  // Householder: the part of d that is free turns into one number. J₂v = z − αj_q is there.
  const double norm = std::sqrt(free_squared_), head = d_[q_];
  const double alpha = head > 0.0 ? -norm : norm;
  const double beta = 1.0 / (free_squared_ - alpha * head);
  double* first = column(q_);
  for (std::size_t i = 0; i < stride_; ++i) y_[i] = beta * (z_[i] - alpha * first[i]);
  d_[q_] -= alpha;
  subtract_outer(first, stride_, n_ - q_, d_.data() + q_, y_.data());
  double* triangle_column = triangle(q_);
  d_[q_] = alpha;
  std::copy_n(d_.data(), q_ + 1, triangle_column);
  ++q_;
}

void ActiveSet::drop(std::size_t position) {
  for (std::size_t j = position; j + 1 < q_; ++j) {
    std::copy_n(triangle(j + 1), j + 2, triangle(j));
  }
  --q_;
  for (std::size_t j = position; j < q_; ++j) {
    double* here = triangle(j);
    const double norm = std::hypot(here[j], here[j + 1]), c = here[j] / norm,
                 s = here[j + 1] / norm;
    here[j] = norm;
    for (std::size_t k = j + 1; k < q_; ++k) {
      double* other = triangle(k);
      const double a = other[j], b = other[j + 1];
      other[j] = c * a + s * b;
      other[j + 1] = c * b - s * a;
    }
    rotate(column(j), column(j + 1), stride_, c, s);
  }
}

void ActiveSet::minimum(const double* g, const double* b, double* x, double* u) {
  dots(J_.data(), stride_, n_, g, y_.data());
  std::copy_n(y_.data(), q_, u);
  solve_transposed(b, y_.data());
  for (std::size_t j = 0; j < q_; ++j) u[j] += y_[j];
  solve(u);
  for (std::size_t j = q_; j < n_; ++j) y_[j] = -y_[j];
  std::fill_n(x, stride_, 0.0);
  add_columns(J_.data(), stride_, n_, y_.data(), x);
}

void ActiveSet::correct(const double* e, double* x) {
  solve_transposed(e, y_.data());
  add_columns(J_.data(), stride_, q_, y_.data(), x);
}

void ActiveSet::solve_transposed(const double* b, double* y) const {
  for (std::size_t j = 0; j < q_; ++j) {
    const double* here = R_.data() + j * stride_;
    y[j] = (b[j] - dot(here, y, j)) / here[j];
  }
}

void ActiveSet::solve(double* y) const {
  for (std::size_t j = q_; j-- > 0;) {
    const double* here = R_.data() + j * stride_;
    y[j] /= here[j];
    for (std::size_t i = 0; i < j; ++i) y[i] -= y[j] * here[i];
  }
}

}  // namespace mimesis::qp
