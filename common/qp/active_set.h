#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>
#include <vector>

#include "common/qp/kernels.h"

namespace mimesis::qp {

/// Factors of the active constraints' normals N (n × q) in the metric of H = L Lᵀ: J = L⁻ᵀQ with Jᵀ
/// N = [R; 0], R an upper triangle [Goldfarb, Idnani 1983, section 4]. J = [J₁ J₂]: J₂ spans the
/// directions that the active constraints leave free. Vectors have stride() numbers, zeros behind
/// the n-th.
class ActiveSet {
 public:
  void reserve(std::size_t n) {
    if (n <= most_) return;
    most_ = n;
    const std::size_t stride = padded(n);
    for (auto* matrix : {&J0_, &J_, &R_, &scratch_}) matrix->assign(stride * n, 0.0);
    for (auto* vector : {&d_, &z_, &r_, &y_}) vector->assign(stride, 0.0);
  }
  /// `hessian`: n columns, `outer` apart. @return false if it is not positive definite.
  bool factor(const double* hessian, std::size_t outer, std::size_t n) {
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
  /// H = I: J is orthogonal
  void factor_identity(std::size_t n) {
    n_ = n;
    stride_ = padded(n);
    for (auto* vector : {&d_, &z_, &r_, &y_}) std::fill(vector->begin(), vector->end(), 0.0);
    std::fill_n(J0_.data(), stride_ * n, 0.0);
    for (std::size_t i = 0; i < n; ++i) J0_[i * stride_ + i] = 1.0;
  }
  /// no constraint is active
  void clear() {
    q_ = 0;
    std::memcpy(J_.data(), J0_.data(), sizeof(double) * stride_ * n_);
  }

  std::size_t n() const { return n_; }
  std::size_t stride() const { return stride_; }
  std::size_t size() const { return q_; }

  /// J: n columns, stride() apart.
  const double* basis() const { return J_.data(); }

  /// Looks from the active constraints at one more, of normal a.
  void look_at(const double* normal) {
    dots(J_.data(), stride_, n_, normal, d_.data());
    judge();
  }
  /// look_at() for the normal ±e_i.
  void look_at_axis(std::size_t i, double sign) {
    for (std::size_t j = 0; j < n_; ++j) d_[j] = sign * J_[j * stride_ + i];
    judge();
  }
  /// True if that normal is linearly independent of the active ones.
  bool independent() const { return independent_; }
  double curvature() const { return free_squared_; }  ///< zᵀa = |J₂ᵀa|²
  /// fills step()
  void find_step() {
    std::fill_n(z_.data(), stride_, 0.0);
    add_columns(column(q_), stride_, n_ - q_, d_.data() + q_, z_.data());
  }
  const double* step() const { return z_.data(); }  ///< z = J₂J₂ᵀa
  /// r = R⁻¹J₁ᵀa, q numbers
  const double* dual_step() {
    std::copy_n(d_.data(), q_, r_.data());
    solve(r_.data());
    return r_.data();
  }
  /// activates the constraint of the last find_step()
  void add() {
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
  /// Jᵀa of the constraint last passed to look_at(): q numbers, then, if it was added, R's new
  /// diagonal element at q − 1.
  const double* coordinates() const { return d_.data(); }
  void drop(std::size_t position) {
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

  /// Minimum of ½xᵀHx + gᵀx on Nᵀx = b, and its multipliers u (q): Hx + g = N u.
  void minimum(const double* g, const double* b, double* x, double* u) {
    dots(J_.data(), stride_, n_, g, y_.data());
    std::copy_n(y_.data(), q_, u);
    solve_transposed(b, y_.data());
    for (std::size_t j = 0; j < q_; ++j) u[j] += y_[j];
    solve(u);
    for (std::size_t j = q_; j < n_; ++j) y_[j] = -y_[j];
    std::fill_n(x, stride_, 0.0);
    add_columns(J_.data(), stride_, n_, y_.data(), x);
  }
  /// x += J₁R⁻ᵀe: Nᵀx grows by e (q).
  void correct(const double* e, double* x) {
    solve_transposed(e, y_.data());
    add_columns(J_.data(), stride_, q_, y_.data(), x);
  }

 private:
  // Sine of the angle between a normal and the active ones' span below which it counts as one of
  // them, in the metric of H.
  static constexpr double kDependent = 1e-10;
  static double dot(const double* a, const double* b, std::size_t n) {
    double sum = 0.0;
    for (std::size_t i = 0; i < n; ++i) sum += a[i] * b[i];
    return sum;
  }

  double* column(std::size_t j) { return J_.data() + j * stride_; }
  double* triangle(std::size_t j) { return R_.data() + j * stride_; }
  void judge() {
    free_squared_ = dot(d_.data() + q_, d_.data() + q_, n_ - q_);
    const double taken_squared = dot(d_.data(), d_.data(), q_);
    independent_ = free_squared_ > kDependent * kDependent * (free_squared_ + taken_squared);
  }
  /// Rᵀy = b
  void solve_transposed(const double* b, double* y) const {
    for (std::size_t j = 0; j < q_; ++j) {
      const double* here = R_.data() + j * stride_;
      y[j] = (b[j] - dot(here, y, j)) / here[j];
    }
  }
  /// y ← R⁻¹y
  void solve(double* y) const {
    for (std::size_t j = q_; j-- > 0;) {
      const double* here = R_.data() + j * stride_;
      y[j] /= here[j];
      for (std::size_t i = 0; i < j; ++i) y[i] -= y[j] * here[i];
    }
  }

  std::size_t n_ = 0, stride_ = 0, q_ = 0, most_ = 0;
  std::vector<double> J0_, J_, R_, scratch_;
  std::vector<double> d_, z_, r_, y_;
  double free_squared_ = 0.0;
  bool independent_ = false;
};

}  // namespace mimesis::qp
