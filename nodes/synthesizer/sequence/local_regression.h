#pragma once
#include <Eigen/Core>

namespace mimesis::synthesizer {

/// Query point of a map that was learned from points: inputs are scaled to the spread of the data,
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

struct MapValue {
  Eigen::VectorXd value;
  double outside = 0.0;  ///< how far the input was moved into the domain, in standard deviations
  bool clamped() const { return outside > 0.0; }
};

struct LocalRegressionOptions {
  /// Width of the Gaussian weights, in standard deviations of the inputs; 0: the best of
  /// leave-one-out over 0.2 .. 6.
  double bandwidth = 0.0;
  /// Ridge penalty of the slopes, relative to the sum of the weights: > 0 keeps a line through two
  /// neighbours from extreme slopes; 0: the best of leave-one-out over 1e-3 .. 1e2.
  double ridge = 0.0;
  double margin = 0.25;  ///< InputDomain
};

/// Locally weighted linear regression [M18 3.4.2, 3.20; Atkeson 1997]: at x the line
///   y = a + B(x' − x̄)   with   min Σᵢ kᵢ |yᵢ − a − B(xᵢ − x̄)|² + ρ Σ kᵢ |B|²,
/// kᵢ = exp(−|xᵢ − x|²/2h²) over scaled inputs, x̄ the weighted mean: where slopes are unknown, the
/// local mean counts. Any number of inputs and outputs.
class LocalRegression {
 public:
  /// `inputs` n×d, `outputs` n×q; `group` (n, or empty): points of one group are left out together
  /// where options are searched (cycles of one clip resemble each other).
  /// @throws ConfigError as InputDomain. @pre sizes that fit, two points or more
  LocalRegression(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs,
                  const LocalRegressionOptions& options = {}, const Eigen::VectorXi& group = {});

  MapValue at(const Eigen::Ref<const Eigen::VectorXd>& input) const;
  Eigen::Index inputs() const { return domain_.scaled().cols(); }
  double bandwidth() const { return bandwidth_; }

 private:
  InputDomain domain_;
  Eigen::MatrixXd outputs_;
  double bandwidth_, ridge_;
};

}  // namespace mimesis::synthesizer
