#pragma once
#include <Eigen/Core>
#include <span>

namespace mimesis::mocap {

/// Natural cubic splines through the rows of a matrix, one per row, over common knots.
class Spline {
 public:
  /// @param knots   increasing, at least two
  /// @param values  R×knots
  Spline(std::span<const double> knots, const Eigen::Ref<const Eigen::MatrixXd>& values);

  /// The rows at `x`; outside the knots the first or last cubic goes on.
  Eigen::VectorXd at(double x) const;

 private:
  Eigen::VectorXd knots_;
  Eigen::MatrixXd values_, curvature_;  // second derivatives at the knots
};

/// Rows sampled at 0, 1, ... F−1, taken at first + (last − first)·t/count, t = 0..count−1: the end
/// of a period is the start of the next and is not repeated. By natural cubic splines.
Eigen::MatrixXd resample(const Eigen::Ref<const Eigen::MatrixXd>& rows, double first, double last,
                         Eigen::Index count);

}  // namespace mimesis::mocap
