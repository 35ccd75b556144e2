#pragma once
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <vector>

#include "common/math/minimum_jerk.h"

namespace mimesis::synthesizer {

/// Minimum-jerk course from 0 at `from` to 1 at `to`, constant outside.
inline double minimum_jerk(double t, double from, double to) {
  const double u = std::clamp((t - from) / (to - from), 0.0, 1.0);
  return math::minimum_jerk(u);
}

/// Cubic with value and slope at both ends of [0, duration], at t.
inline double hermite(double t, double duration, double x0, double v0, double x1, double v1) {
  const double u = t / duration, u2 = u * u, u3 = u2 * u;
  return (2.0 * u3 - 3.0 * u2 + 1.0) * x0 + (u3 - 2.0 * u2 + u) * duration * v0 +
         (3.0 * u2 - 2.0 * u3) * x1 + (u3 - u2) * duration * v1;
}

/// Twice continuously differentiable curve through knots with given slopes at both ends; constant
/// slope before the first, constant value after the last knot (so end with slope 0).
class SmoothCurve {
 public:
  /// Times must rise; at least two knots.
  SmoothCurve(std::vector<double> times, std::vector<double> values, double slope_first,
              double slope_last)
      : t_(std::move(times)), x_(std::move(values)) {
    const auto n = static_cast<Eigen::Index>(t_.size());
    Eigen::MatrixXd a = Eigen::MatrixXd::Identity(n, n);
    Eigen::VectorXd b(n);
    b(0) = slope_first;
    b(n - 1) = slope_last;
    for (Eigen::Index i = 1; i + 1 < n; ++i) {  // equal second derivatives on both sides of knot i
      const auto k = static_cast<std::size_t>(i);
      const double h0 = t_[k] - t_[k - 1], h1 = t_[k + 1] - t_[k];
      a(i, i - 1) = 1.0 / h0;
      a(i, i) = 2.0 / h0 + 2.0 / h1;
      a(i, i + 1) = 1.0 / h1;
      b(i) = 3.0 * ((x_[k] - x_[k - 1]) / (h0 * h0) + (x_[k + 1] - x_[k]) / (h1 * h1));
    }
    const Eigen::VectorXd slopes = a.partialPivLu().solve(b);
    v_.assign(slopes.data(), slopes.data() + n);
  }

  double at(double t) const {
    if (t <= t_.front()) return x_.front() + v_.front() * (t - t_.front());
    if (t >= t_.back()) return x_.back();
    const auto k =
        static_cast<std::size_t>(std::upper_bound(t_.begin(), t_.end(), t) - t_.begin() - 1);
    return hermite(t - t_[k], t_[k + 1] - t_[k], x_[k], v_[k], x_[k + 1], v_[k + 1]);
  }

 private:
  std::vector<double> t_, x_, v_;
};

}  // namespace mimesis::synthesizer
