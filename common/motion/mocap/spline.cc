#include "common/motion/mocap/spline.h"

#include <algorithm>
#include <numeric>
#include <vector>

#include "common/error.h"

namespace mimesis::mocap {

// The second derivatives solve a tridiagonal system, here by elimination from below to above
// (Thomas); natural ends: zero.
Spline::Spline(std::span<const double> knots, const Eigen::Ref<const Eigen::MatrixXd>& values)
    : knots_(
          Eigen::Map<const Eigen::VectorXd>(knots.data(), static_cast<Eigen::Index>(knots.size()))),
      values_(values),
      curvature_(Eigen::MatrixXd::Zero(values.rows(), values.cols())) {
  const Eigen::Index n = knots_.size();
  MIMESIS_ASSERT(n >= 2 && values.cols() == n);
  Eigen::VectorXd upper = Eigen::VectorXd::Zero(n);
  for (Eigen::Index i = 1; i + 1 < n; ++i) {
    const double before = knots_[i] - knots_[i - 1], after = knots_[i + 1] - knots_[i];
    const double pivot = 2.0 * (before + after) - before * upper[i - 1];
    upper[i] = after / pivot;
    const Eigen::VectorXd bend = (values_.col(i + 1) - values_.col(i)) / after -
                                 (values_.col(i) - values_.col(i - 1)) / before;
    curvature_.col(i) = (6.0 * bend - before * curvature_.col(i - 1)) / pivot;
  }
  for (Eigen::Index i = n - 2; i >= 1; --i) curvature_.col(i) -= upper[i] * curvature_.col(i + 1);
}

Eigen::VectorXd Spline::at(double x) const {
  const double* const begin = knots_.data();
  const auto above = std::upper_bound(begin, begin + knots_.size(), x) - begin;
  const Eigen::Index i = std::clamp<Eigen::Index>(above - 1, 0, knots_.size() - 2);
  const double h = knots_[i + 1] - knots_[i];
  const double a = (knots_[i + 1] - x) / h, b = 1.0 - a;
  return a * values_.col(i) + b * values_.col(i + 1) +
         (h * h / 6.0) *
             ((a * a * a - a) * curvature_.col(i) + (b * b * b - b) * curvature_.col(i + 1));
}

Eigen::MatrixXd resample(const Eigen::Ref<const Eigen::MatrixXd>& rows, double first, double last,
                         Eigen::Index count) {
  std::vector<double> knots(static_cast<std::size_t>(rows.cols()));
  std::iota(knots.begin(), knots.end(), 0.0);
  const Spline spline(knots, rows);
  Eigen::MatrixXd out(rows.rows(), count);
  for (Eigen::Index t = 0; t < count; ++t) {
    out.col(t) =
        spline.at(first + (last - first) * static_cast<double>(t) / static_cast<double>(count));
  }
  return out;
}

}  // namespace mimesis::mocap
