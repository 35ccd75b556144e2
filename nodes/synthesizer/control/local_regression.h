#pragma once
#include "nodes/synthesizer/control/input_domain.h"

namespace mimesis::synthesizer {

/// What a map says at a point.
struct MapValue {
  Eigen::VectorXd value;
  double outside = 0.0;  ///< how far the input was moved into the domain, in standard deviations
  bool clamped() const { return outside > 0.0; }
};

struct LocalRegressionOptions {
  /// Width of the Gaussian weights, in standard deviations of the inputs; 0: the best of
  /// leave-one-out over 0.2 .. 6.
  double bandwidth = 0.0;
  /// Of the slopes, relative to the sum of the weights: > 0 keeps a line through two neighbours
  /// from turning wild; 0: the best of leave-one-out over 1e-3 .. 1e2.
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
  /// @throws ConfigError for sizes that do not fit, fewer than two points, options out of range.
  LocalRegression(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs,
                  const LocalRegressionOptions& options = {}, const Eigen::VectorXi& group = {});

  MapValue at(const Eigen::Ref<const Eigen::VectorXd>& input) const;
  double bandwidth() const { return bandwidth_; }
  double ridge() const { return ridge_; }

 private:
  InputDomain domain_;
  Eigen::MatrixXd outputs_;
  double bandwidth_, ridge_;
};

}  // namespace mimesis::synthesizer
