#pragma once
#include <vector>

#include "nodes/synthesizer/sequence/local_regression.h"

namespace mimesis::synthesizer {

/// Shape of the covariance, in scaled inputs and relative to the variance of the smooth part.
struct Covariance {
  double length = 1.0;  ///< ℓ of the radial part [standard deviations of the inputs]
  double linear = 0.1;  ///< variance of a linear trend
  double noise = 0.3;   ///< noise of single trials
};

struct GaussianProcessOptions {
  enum class Fit { marginal_likelihood, leave_one_out, given };
  Fit fit = Fit::marginal_likelihood;
  Covariance start;      ///< start of the search, or the given covariance
  double margin = 0.25;  ///< InputDomain
};

/// Gaussian process regression with
///   k(x, x') = exp(−|x − x'|²/2ℓ²) + linear·xᵀx' + noise·δ
/// around the mean of the data, the same for all outputs; far from the data it returns to the
/// trend, and single trials are averaged as `noise` says. ([M18 3.4.2, 3.4.3] name it beside LWLR.)
///
/// ℓ, linear and noise maximise the marginal likelihood, its variance put in analytically, or
/// minimise the squared error with one group left out; a compass search on their logarithms within
/// ℓ 0.2..10, linear 1e-4..10, noise 1e-3..30: same data, same bits. O(n³) per evaluation.
class GaussianProcess {
 public:
  /// Like LocalRegression.
  GaussianProcess(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs,
                  const GaussianProcessOptions& options = {}, const Eigen::VectorXi& group = {});

  MapValue at(const Eigen::Ref<const Eigen::VectorXd>& input) const;
  /// Standard deviation of the smooth part at a point, relative to that far from all data without
  /// trend; of the point within the domain.
  double deviation(const Eigen::Ref<const Eigen::VectorXd>& input) const;
  const Covariance& covariance() const { return shape_; }

 private:
  InputDomain domain_;
  Covariance shape_;
  Eigen::RowVectorXd mean_;
  Eigen::MatrixXd inverse_, coefficients_;  // (K + noise)⁻¹ and that times the outputs
};

}  // namespace mimesis::synthesizer
