#pragma once
#include <cstddef>
#include <vector>

namespace mimesis::qp {

/// Factors of the active constraints' normals N (n × q) in the metric of H = L Lᵀ: J = L⁻ᵀQ with Jᵀ
/// N = [R; 0], R an upper triangle [Goldfarb, Idnani 1983, section 4]. J = [J₁ J₂]: J₂ spans the
/// directions that the active constraints leave free. Vectors have stride() numbers, zeros behind
/// the n-th.
class ActiveSet {
 public:
  void reserve(std::size_t n);
  /// `hessian`: n columns, `outer` apart. @return false if it is not positive definite.
  bool factor(const double* hessian, std::size_t outer, std::size_t n);
  void factor_identity(std::size_t n);  ///< H = I: J is orthogonal
  void clear();                         ///< no constraint is active

  std::size_t n() const { return n_; }
  std::size_t stride() const { return stride_; }
  std::size_t size() const { return q_; }

  /// J: n columns, stride() apart.
  const double* basis() const { return J_.data(); }

  /// Looks from the active constraints at one more, of normal a.
  void look_at(const double* normal);
  /// look_at() for the normal ±e_i.
  void look_at_axis(std::size_t i, double sign);
  /// True if that normal is linearly independent of the active ones.
  bool independent() const { return independent_; }
  double curvature() const { return free_squared_; }  ///< zᵀa = |J₂ᵀa|²
  void find_step();                                   ///< fills step()
  const double* step() const { return z_.data(); }    ///< z = J₂J₂ᵀa
  const double* dual_step();                          ///< r = R⁻¹J₁ᵀa, q numbers
  void add();  ///< activates the constraint of the last find_step()
  /// Jᵀa of the constraint last passed to look_at(): q numbers, then, if it was added, R's new
  /// diagonal element at q − 1.
  const double* coordinates() const { return d_.data(); }
  void drop(std::size_t position);

  /// Minimum of ½xᵀHx + gᵀx on Nᵀx = b, and its multipliers u (q): Hx + g = N u.
  void minimum(const double* g, const double* b, double* x, double* u);
  /// x += J₁R⁻ᵀe: Nᵀx grows by e (q).
  void correct(const double* e, double* x);

 private:
  double* column(std::size_t j) { return J_.data() + j * stride_; }
  double* triangle(std::size_t j) { return R_.data() + j * stride_; }
  void judge();
  void solve_transposed(const double* b, double* y) const;  ///< Rᵀy = b
  void solve(double* y) const;                              ///< y ← R⁻¹y

  std::size_t n_ = 0, stride_ = 0, q_ = 0, most_ = 0;
  std::vector<double> J0_, J_, R_, scratch_;
  std::vector<double> d_, z_, r_, y_;
  double free_squared_ = 0.0;
  bool independent_ = false;
};

}  // namespace mimesis::qp
