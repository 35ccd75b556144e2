#include "nodes/synthesizer/control/input_domain.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
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

}  // namespace mimesis::synthesizer
