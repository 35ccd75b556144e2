#include "nodes/synthesizer/control/local_regression.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "common/error.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;

/// The local line at x, with the points of weight zero in `use` left out.
Eigen::VectorXd line_at(const Eigen::MatrixXd& x_data, const Eigen::MatrixXd& y_data,
                        const Eigen::VectorXd& x, double bandwidth, double ridge,
                        const Eigen::VectorXd& use) {
  Eigen::VectorXd exponent =
      (x_data.rowwise() - x.transpose()).rowwise().squaredNorm() / (2.0 * bandwidth * bandwidth);
  // relative to the nearest used point: far away the weights do not underflow
  double nearest = std::numeric_limits<double>::infinity();
  for (Index i = 0; i < exponent.size(); ++i) {
    if (use[i] > 0.0) nearest = std::min(nearest, exponent[i]);
  }
  const Eigen::VectorXd k = use.array() * (nearest - exponent.array()).min(0.0).exp();
  const double sum = k.sum();
  const Eigen::RowVectorXd x_mean = k.transpose() * x_data / sum;
  const Eigen::RowVectorXd y_mean = k.transpose() * y_data / sum;
  const Eigen::MatrixXd dx = x_data.rowwise() - x_mean;
  Eigen::MatrixXd gram = dx.transpose() * k.asDiagonal() * dx;
  gram.diagonal().array() += ridge * sum;
  const Eigen::MatrixXd slope =
      gram.ldlt().solve(dx.transpose() * k.asDiagonal() * (y_data.rowwise() - y_mean));
  return (y_mean + (x.transpose() - x_mean) * slope).transpose();
}

double left_out_error(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y,
                      const Eigen::VectorXi& group, double bandwidth, double ridge) {
  double error = 0.0;
  for (Index i = 0; i < x.rows(); ++i) {
    Eigen::VectorXd use = Eigen::VectorXd::Ones(x.rows());
    for (Index j = 0; j < x.rows(); ++j) use[j] = group[j] == group[i] ? 0.0 : 1.0;
    if (use.sum() == 0.0) continue;
    const Eigen::VectorXd at = line_at(x, y, x.row(i), bandwidth, ridge, use);
    error += (at.transpose() - y.row(i)).squaredNorm();
  }
  return error;
}

}  // namespace

LocalRegression::LocalRegression(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs,
                                 const LocalRegressionOptions& options,
                                 const Eigen::VectorXi& group)
    : domain_(inputs, options.margin),
      outputs_(outputs),
      bandwidth_(options.bandwidth),
      ridge_(options.ridge) {
  const Index n = inputs.rows();
  if (outputs.rows() != n || n < 2 || (group.size() != 0 && group.size() != n)) {
    throw ConfigError("map: " + std::to_string(n) + " inputs and " +
                      std::to_string(outputs.rows()) + " outputs, expected as many, at least two");
  }
  if (!outputs.allFinite()) throw ConfigError("map: an output is not a finite number");
  if (!(bandwidth_ >= 0.0) || !(ridge_ >= 0.0)) {
    throw ConfigError("map: bandwidth and ridge may not be negative");
  }
  const Eigen::VectorXi groups =
      group.size() ? group : Eigen::VectorXi::LinSpaced(n, 0, static_cast<int>(n) - 1);
  constexpr std::array kBandwidths = {0.2, 0.3, 0.45, 0.7, 1.0, 1.5, 2.2, 3.5, 6.0};
  constexpr std::array kRidges = {1e-3, 1e-2, 3e-2, 0.1, 0.3, 1.0, 3.0, 10.0, 100.0};
  double best = std::numeric_limits<double>::infinity();
  for (const double h : kBandwidths) {
    if (options.bandwidth > 0.0 && h != kBandwidths[0]) continue;
    for (const double r : kRidges) {
      if (options.ridge > 0.0 && r != kRidges[0]) continue;
      const double bandwidth = options.bandwidth > 0.0 ? options.bandwidth : h;
      const double ridge = options.ridge > 0.0 ? options.ridge : r;
      const double error = left_out_error(domain_.scaled(), outputs_, groups, bandwidth, ridge);
      if (error >= best) continue;
      best = error;
      bandwidth_ = bandwidth;
      ridge_ = ridge;
    }
  }
}

MapValue LocalRegression::at(const Eigen::Ref<const Eigen::VectorXd>& input) const {
  const InputDomain::Point p = domain_.bring_in(input);
  return {line_at(domain_.scaled(), outputs_, p.x, bandwidth_, ridge_,
                  Eigen::VectorXd::Ones(outputs_.rows())),
          p.outside};
}

}  // namespace mimesis::synthesizer
