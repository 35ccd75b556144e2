#pragma once
#include <Eigen/Core>
#include <span>

namespace mimesis::mocap {

/// Zero-phase low-pass of every row: a Butterworth filter of `order` (even), run forwards and then
/// backwards. By the bilinear transform with the cutoff prewarped, a sine of frequency f keeps its
/// phase and the share 1 / (1 + (tan(πf/rate) / tan(πf_c/rate))^(2·order)) of its amplitude: one
/// half at the cutoff. At both ends the row is continued by three periods of the cutoff, or its
/// own length if that is shorter, reflected in its end point, so that a ramp stays a ramp; the
/// filter starts in the steady state of its first value.
/// @param rows       R×F, finite, F ≥ 2
/// @param cutoff_hz  in (0, rate/2)
/// @throws ConfigError if rate, cutoff or order do not fit or a value is not finite
Eigen::MatrixXd low_pass(const Eigen::Ref<const Eigen::MatrixXd>& rows, double rate_hz,
                         double cutoff_hz, int order = 2);

/// Natural cubic splines through the rows of a matrix, one per row, over common knots.
class Spline {
 public:
  /// @param knots   increasing, at least two
  /// @param values  R×knots
  Spline(std::span<const double> knots, const Eigen::Ref<const Eigen::MatrixXd>& values);

  /// The rows at `x`; outside the knots the first or last cubic is extended.
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
