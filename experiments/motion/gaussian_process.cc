#include "experiments/motion/gaussian_process.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/error.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;
using Logs = std::array<double, 3>;  // logarithms of ℓ, linear, noise

constexpr Logs kLow = {-1.609, -9.21, -6.91}, kHigh = {2.303, 2.303, 3.401};

Covariance shape_of(const Logs& logs) {
  return {std::exp(logs[0]), std::exp(logs[1]), std::exp(logs[2])};
}

/// Between the rows of a and b.
Eigen::MatrixXd kernel(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b,
                       const Covariance& shape) {
  Eigen::MatrixXd k = shape.linear * (a * b.transpose());
  for (Index j = 0; j < b.rows(); ++j) {
    k.col(j).array() += ((a.rowwise() - b.row(j)).rowwise().squaredNorm().array() /
                         (-2.0 * shape.length * shape.length))
                            .exp();
  }
  return k;
}

Eigen::MatrixXd with_noise(Eigen::MatrixXd k, double noise) {
  k.diagonal().array() += noise + 1e-10;
  return k;
}

/// −2/q · log of the likelihood with the best variance, up to constants. One variance for all
/// outputs: those that vary little count little.
double likelihood_cost(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y,
                       const Covariance& shape) {
  const Eigen::LLT<Eigen::MatrixXd> llt(with_noise(kernel(x, x, shape), shape.noise));
  const double misfit = std::max(llt.matrixL().solve(y).squaredNorm(), 1e-300);
  const Eigen::MatrixXd l = llt.matrixL();
  const double n = static_cast<double>(x.rows());
  return n * std::log(misfit / (n * static_cast<double>(y.cols()))) +
         2.0 * l.diagonal().array().log().sum();
}

double left_out_cost(const Eigen::MatrixXd& x, const Eigen::MatrixXd& y, const Covariance& shape,
                     const Eigen::VectorXi& group) {
  double error = 0.0;
  for (int g = group.minCoeff(); g <= group.maxCoeff(); ++g) {
    std::vector<Index> in, out;
    for (Index i = 0; i < x.rows(); ++i) (group[i] == g ? out : in).push_back(i);
    if (in.empty() || out.empty()) continue;
    const Eigen::MatrixXd x_in = x(in, Eigen::all), y_in = y(in, Eigen::all);
    const Eigen::RowVectorXd mean = y_in.colwise().mean();
    const Eigen::MatrixXd k = with_noise(kernel(x_in, x_in, shape), shape.noise);
    const Eigen::MatrixXd at =
        kernel(x(out, Eigen::all), x_in, shape) * k.llt().solve(y_in.rowwise() - mean);
    error += ((at.rowwise() + mean) - y(out, Eigen::all)).squaredNorm();
  }
  return error;
}

/// Compass search: the better of a step to either side along each axis, steps halved when none is.
template <class Cost>
Covariance search(const Covariance& start, Cost cost) {
  Logs at = {std::log(start.length), std::log(start.linear), std::log(start.noise)};
  double best = cost(shape_of(at));
  for (double step = 1.6; step > 0.02;) {
    bool better = false;
    for (std::size_t i = 0; i < at.size(); ++i) {
      for (const double side : {-step, step}) {
        Logs to = at;
        to[i] = std::clamp(to[i] + side, kLow[i], kHigh[i]);
        const double c = cost(shape_of(to));
        if (!(c < best)) continue;
        best = c;
        at = to;
        better = true;
      }
    }
    if (!better) step *= 0.5;
  }
  return shape_of(at);
}

}  // namespace

GaussianProcess::GaussianProcess(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs,
                                 const GaussianProcessOptions& options,
                                 const Eigen::VectorXi& group)
    : domain_(inputs, options.margin), shape_(options.start) {
  const Index n = inputs.rows();
  if (outputs.rows() != n || n < 2 || (group.size() != 0 && group.size() != n)) {
    throw ConfigError("map: " + std::to_string(n) + " inputs and " +
                      std::to_string(outputs.rows()) + " outputs, expected as many, at least two");
  }
  if (!outputs.allFinite()) throw ConfigError("map: an output is not a finite number");
  if (!(shape_.length > 0.0 && shape_.linear > 0.0 && shape_.noise > 0.0)) {
    throw ConfigError("map: length, linear and noise of a covariance must be positive");
  }
  const Eigen::MatrixXd& x = domain_.scaled();
  mean_ = outputs.colwise().mean();
  const Eigen::MatrixXd y = outputs.rowwise() - mean_;
  if (options.fit == GaussianProcessOptions::Fit::marginal_likelihood) {
    shape_ = search(shape_, [&](const Covariance& c) { return likelihood_cost(x, y, c); });
  } else if (options.fit == GaussianProcessOptions::Fit::leave_one_out) {
    const Eigen::VectorXi groups =
        group.size() ? group : Eigen::VectorXi::LinSpaced(n, 0, static_cast<int>(n) - 1);
    shape_ = search(shape_, [&](const Covariance& c) { return left_out_cost(x, y, c, groups); });
  }
  const Eigen::MatrixXd k = with_noise(kernel(x, x, shape_), shape_.noise);
  inverse_ = k.llt().solve(Eigen::MatrixXd::Identity(n, n));
  coefficients_ = inverse_ * y;
}

MapValue GaussianProcess::at(const Eigen::Ref<const Eigen::VectorXd>& input) const {
  const InputDomain::Point p = domain_.bring_in(input);
  const Eigen::RowVectorXd k = kernel(p.x.transpose(), domain_.scaled(), shape_);
  return {(k * coefficients_ + mean_).transpose(), p.outside};
}

double GaussianProcess::deviation(const Eigen::Ref<const Eigen::VectorXd>& input) const {
  const Eigen::MatrixXd x = domain_.bring_in(input).x.transpose();
  const Eigen::RowVectorXd k = kernel(x, domain_.scaled(), shape_);
  const double variance = kernel(x, x, shape_)(0, 0) - (k * inverse_).dot(k);
  return std::sqrt(std::max(0.0, variance));
}

}  // namespace mimesis::synthesizer
