#include "nodes/synthesizer/sequence/local_regression.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "common/error.h"

namespace mimesis::synthesizer {

using Eigen::Index;

namespace {

/// Weights of sum one for which Σ λᵢ pᵢ is nearest to the origin, of either sign. Columns of p.
Eigen::VectorXd affine_minimum(const Eigen::MatrixXd& p) {
  const Index k = p.cols();
  Eigen::MatrixXd a = Eigen::MatrixXd::Ones(k + 1, k + 1);
  a.topLeftCorner(k, k) = p.transpose() * p;
  a(k, k) = 0.0;
  Eigen::VectorXd b = Eigen::VectorXd::Zero(k + 1);
  b[k] = 1.0;
  return a.fullPivLu().solve(b).head(k);
}

Eigen::MatrixXd columns(const Eigen::MatrixXd& points, const std::vector<Index>& chosen,
                        const Eigen::VectorXd& origin) {
  Eigen::MatrixXd p(points.cols(), static_cast<Index>(chosen.size()));
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    p.col(static_cast<Index>(i)) = points.row(chosen[i]).transpose() - origin;
  }
  return p;
}

/// Removes corners until the nearest point of the affine hull of the rest is a convex combination.
void settle(const Eigen::MatrixXd& points, const Eigen::VectorXd& x, std::vector<Index>& corners,
            Eigen::VectorXd& weight) {
  for (;;) {
    const Eigen::VectorXd next = affine_minimum(columns(points, corners, x));
    double step = 1.0;
    for (Index i = 0; i < next.size(); ++i) {
      if (next[i] < 1e-12) step = std::min(step, weight[i] / (weight[i] - next[i]));
    }
    weight += step * (next - weight);
    if (step >= 1.0) return;
    Eigen::VectorXd kept(weight.size());
    std::vector<Index> rest;
    for (Index i = 0; i < weight.size(); ++i) {
      if (weight[i] < 1e-12) continue;
      kept[static_cast<Index>(rest.size())] = weight[i];
      rest.push_back(corners[static_cast<std::size_t>(i)]);
    }
    corners = rest;
    weight = kept.head(static_cast<Index>(rest.size()));
    weight /= weight.sum();
  }
}

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

Eigen::VectorXd nearest_in_hull(const Eigen::MatrixXd& points, const Eigen::VectorXd& x) {
  Index first = 0;
  (points.rowwise() - x.transpose()).rowwise().squaredNorm().minCoeff(&first);
  std::vector<Index> corners = {first};
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(1);
  Eigen::VectorXd y = points.row(first).transpose() - x;
  for (Index i = 0; i < 10 * points.rows() + 10; ++i) {
    Index best = 0;
    const Eigen::VectorXd along = (points.rowwise() - x.transpose()) * y;
    // no corner is nearer to x along y than y itself: y is the nearest
    if (along.minCoeff(&best) >= y.squaredNorm() - 1e-12) break;
    if (std::find(corners.begin(), corners.end(), best) != corners.end()) break;
    corners.push_back(best);
    weight.conservativeResize(weight.size() + 1);
    weight[weight.size() - 1] = 0.0;
    settle(points, x, corners, weight);
    y = columns(points, corners, x) * weight;
  }
  return x + y;
}

InputDomain::InputDomain(const Eigen::MatrixXd& inputs, double margin) : margin_(margin) {
  if (inputs.rows() == 0 || inputs.cols() == 0) throw ConfigError("map: no training points");
  if (!inputs.allFinite()) throw ConfigError("map: an input is not a finite number");
  if (!(margin >= 0.0)) throw ConfigError("map: margin is negative");
  mean_ = inputs.colwise().mean();
  const Eigen::MatrixXd centred = inputs.rowwise() - mean_;
  scale_ = (centred.colwise().squaredNorm() / static_cast<double>(inputs.rows())).cwiseSqrt();
  // an input that does not vary says nothing: any value is clamped to it
  for (double& s : scale_) s = s > 1e-12 ? s : 1.0;
  scaled_ = centred.array().rowwise() / scale_.array();
}

InputDomain::Point InputDomain::bring_in(const Eigen::Ref<const Eigen::VectorXd>& input) const {
  if (input.size() != mean_.size()) {
    throw ConfigError("map: " + std::to_string(input.size()) + " inputs, expected " +
                      std::to_string(mean_.size()));
  }
  if (!input.allFinite()) throw ConfigError("map: an input is not a finite number");
  const Eigen::VectorXd x = (input.transpose() - mean_).array() / scale_.array();
  const Eigen::VectorXd inside = nearest_in_hull(scaled_, x);
  const double distance = (x - inside).norm();
  if (distance <= margin_ + 1e-9) return {x, 0.0};
  return {inside + (margin_ / distance) * (x - inside), distance - margin_};
}

LocalRegression::LocalRegression(const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs,
                                 const LocalRegressionOptions& options,
                                 const Eigen::VectorXi& group)
    : domain_(inputs, options.margin),
      outputs_(outputs),
      bandwidth_(options.bandwidth),
      ridge_(options.ridge) {
  const Index n = inputs.rows();
  MIMESIS_ASSERT(outputs.rows() == n && n >= 2 && (group.size() == 0 || group.size() == n));
  MIMESIS_ASSERT(outputs.allFinite() && bandwidth_ >= 0.0 && ridge_ >= 0.0);
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
