#pragma once
#include <Eigen/Core>

namespace mimesis::synthesizer {

/// Where a map that was learned from points is asked: inputs are scaled to the spread of the data,
/// and points outside are brought back, so that a far goal gives the motion of the nearest learned
/// ones and not an extrapolation.
///
/// The domain is the convex hull of the data, widened by `margin`: a point outside moves towards
/// its projection onto the hull until it is no more than `margin` away. This projection is
/// continuous (it moves two points no further apart), so a moving goal moves the motion smoothly.
class InputDomain {
 public:
  struct Point {
    Eigen::VectorXd x;     ///< scaled input, within the domain
    double outside = 0.0;  ///< how far it was moved, in standard deviations
    bool clamped() const { return outside > 0.0; }
  };

  InputDomain() = default;
  /// `inputs` n×d, `margin` >= 0 in standard deviations of the inputs.
  /// @throws ConfigError for no points, numbers that are not finite, a negative margin.
  InputDomain(const Eigen::MatrixXd& inputs, double margin);

  /// @throws ConfigError for another number of inputs or one that is not finite.
  Point bring_in(const Eigen::Ref<const Eigen::VectorXd>& input) const;

  const Eigen::MatrixXd& scaled() const { return scaled_; }  ///< the data, n×d

 private:
  Eigen::RowVectorXd mean_, scale_;
  Eigen::MatrixXd scaled_;
  double margin_ = 0.0;
};

/// The point of the convex hull of the rows of `points` (n×d) nearest to x, by Wolfe's method;
/// within 1e-9 of the exact distance.
Eigen::VectorXd nearest_in_hull(const Eigen::MatrixXd& points, const Eigen::VectorXd& x);

}  // namespace mimesis::synthesizer
