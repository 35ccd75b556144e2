#include "experiments/motion/style_content.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "common/error.h"
#include "experiments/motion/svd.h"

namespace mimesis::synthesizer {
namespace {

using Eigen::Index;

/// All corners of a regular grid over [0, 1]ᴳ.
Eigen::MatrixXd grid(int per_axis, Index axes) {
  Index count = 1;
  for (Index a = 0; a < axes; ++a) count *= per_axis;
  Eigen::MatrixXd points(count, axes);
  for (Index i = 0; i < count; ++i) {
    Index rest = i;
    for (Index a = 0; a < axes; ++a) {
      points(i, a) = per_axis == 1
                         ? 0.5
                         : static_cast<double>(rest % per_axis) / static_cast<double>(per_axis - 1);
      rest /= per_axis;
    }
  }
  return points;
}

/// The matrix with orthonormal columns nearest to v (for one column v/|v|).
Eigen::MatrixXd orthonormal(const Eigen::MatrixXd& v) {
  const Svd svd = thin_svd(v);
  return svd.U * svd.V.transpose();
}

void check(const Eigen::MatrixXd& goals, const Eigen::MatrixXd& features,
           const StyleContentOptions& o) {
  const auto fail = [](const std::string& what) { throw ConfigError("style-content: " + what); };
  if (goals.rows() != features.rows() || goals.rows() < 2 || goals.cols() < 1) {
    fail(std::to_string(goals.rows()) + " goals and " + std::to_string(features.rows()) +
         " features, expected as many, at least two");
  }
  if (!goals.allFinite() || !features.allFinite()) fail("a goal or feature is not a finite number");
  if (o.styles < 1 || o.styles > features.cols()) {
    fail(std::to_string(o.styles) + " styles, expected 1.." + std::to_string(features.cols()));
  }
  if (o.styles > 1 && o.start == StyleContentOptions::Start::norm) {
    fail("norms begin one style only");
  }
  if (o.centres < 1 || !(o.width > 0.0) || o.iterations < 0) {
    fail("centres and width must be positive");
  }
}

}  // namespace

StyleContent::StyleContent(const Eigen::MatrixXd& goals, const Eigen::MatrixXd& features,
                           const StyleContentOptions& options)
    : options_(options) {
  check(goals, features, options);
  low_ = goals.colwise().minCoeff();
  range_ = goals.colwise().maxCoeff() - goals.colwise().minCoeff();
  for (double& r : range_) r = r > 1e-12 ? r : 1.0;
  goals_.resize(goals.rows(), goals.cols());
  for (Index i = 0; i < goals.rows(); ++i) goals_.row(i) = scaled(goals.row(i));
  centres_ = grid(options.centres, goals.cols());
  Eigen::MatrixXd psi(goals.rows(), centres_.rows());
  for (Index i = 0; i < goals.rows(); ++i) psi.row(i) = basis(goals.row(i));
  smoother_ = psi.completeOrthogonalDecomposition().pseudoInverse();
  mean_ = smoother_ * features;
  const Eigen::MatrixXd residual = features - psi * mean_;
  start(residual, psi, options.start == StyleContentOptions::Start::norm);
  for (int i = 0; i < options.iterations; ++i) {
    regress(residual);
    for (Index n = 0; n < residual.rows(); ++n) {
      style_.row(n) = residual.row(n) * directions_at(psi.row(n));
    }
  }
  regress(residual);
}

Eigen::VectorXd StyleContent::scaled(const Eigen::VectorXd& goal) const {
  if (goal.size() != low_.size()) {
    throw ConfigError("style-content: a goal of " + std::to_string(goal.size()) +
                      " numbers, expected " + std::to_string(low_.size()));
  }
  return (goal - low_).cwiseQuotient(range_);
}

Eigen::RowVectorXd StyleContent::basis(const Eigen::VectorXd& goal) const {
  const double spacing = options_.centres > 1 ? 1.0 / (options_.centres - 1) : 1.0;
  const double sigma = options_.width * spacing;
  return ((centres_.rowwise() - scaled(goal).transpose()).rowwise().squaredNorm().array() /
          (-2.0 * sigma * sigma))
      .exp()
      .matrix()
      .transpose();
}

/// Style values to begin with.
void StyleContent::start(const Eigen::MatrixXd& residual, const Eigen::MatrixXd& psi,
                         bool by_norm) {
  const Index n = residual.rows(), f = residual.cols(), s = options_.styles;
  style_ = Eigen::MatrixXd::Zero(n, s);
  if (by_norm) {
    style_.col(0) = residual.rowwise().norm();
    return;
  }
  // main directions of the smoothed second moments RᵀR
  std::vector<Eigen::MatrixXd> main(static_cast<std::size_t>(n));
  Eigen::MatrixXd moments(n, f * f);
  for (Index i = 0; i < n; ++i) {
    moments.row(i) = (residual.row(i).transpose() * residual.row(i)).reshaped().transpose();
  }
  const Eigen::MatrixXd smooth = psi * (smoother_ * moments);
  for (Index i = 0; i < n; ++i) {
    const Eigen::MatrixXd c = smooth.row(i).reshaped(f, f);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(c);
    main[static_cast<std::size_t>(i)] = eigen.eigenvectors().rightCols(s).rowwise().reverse();
  }
  // outwards from the first motion, the nearest one next: turned to agree with its neighbour
  std::vector<bool> done(static_cast<std::size_t>(n), false);
  Eigen::VectorXd distance = Eigen::VectorXd::Constant(n, std::numeric_limits<double>::infinity());
  std::vector<Index> neighbour(static_cast<std::size_t>(n), 0);
  distance[0] = 0.0;
  for (Index step = 0; step < n; ++step) {
    Index next = -1;
    for (Index i = 0; i < n; ++i) {
      if (!done[static_cast<std::size_t>(i)] && (next < 0 || distance[i] < distance[next]))
        next = i;
    }
    auto& here = main[static_cast<std::size_t>(next)];
    const auto& there = main[static_cast<std::size_t>(neighbour[static_cast<std::size_t>(next)])];
    here = here * orthonormal(here.transpose() * there);
    style_.row(next) = residual.row(next) * here;
    done[static_cast<std::size_t>(next)] = true;
    for (Index i = 0; i < n; ++i) {
      const double d = (goals_.row(i) - goals_.row(next)).norm();
      if (done[static_cast<std::size_t>(i)] || d >= distance[i]) continue;
      distance[i] = d;
      neighbour[static_cast<std::size_t>(i)] = next;
    }
  }
}

/// V = Ψ(ΨᵀΨ)†Ψᵀ(R∘s), as coefficients of the basis.
void StyleContent::regress(const Eigen::MatrixXd& residual) {
  const Index f = residual.cols();
  Eigen::MatrixXd products(residual.rows(), f * style_.cols());
  for (Index s = 0; s < style_.cols(); ++s) {
    products.middleCols(s * f, f) = residual.array().colwise() * style_.col(s).array();
  }
  direction_ = smoother_ * products;
}

Eigen::MatrixXd StyleContent::directions_at(const Eigen::RowVectorXd& psi) const {
  return orthonormal((psi * direction_).reshaped(mean_.cols(), options_.styles));
}

Eigen::VectorXd StyleContent::mean(const Eigen::VectorXd& goal) const {
  return (basis(goal) * mean_).transpose();
}

Eigen::MatrixXd StyleContent::directions(const Eigen::VectorXd& goal) const {
  return directions_at(basis(goal));
}

Eigen::VectorXd StyleContent::style_of(const Eigen::VectorXd& goal,
                                       const Eigen::VectorXd& feature) const {
  const Eigen::RowVectorXd psi = basis(goal);
  return directions_at(psi).transpose() * (feature - (psi * mean_).transpose());
}

Eigen::VectorXd StyleContent::feature(const Eigen::VectorXd& goal,
                                      const Eigen::VectorXd& style) const {
  const Eigen::RowVectorXd psi = basis(goal);
  return (psi * mean_).transpose() + directions_at(psi) * style;
}

Eigen::VectorXd StyleContent::infer_style(const Eigen::VectorXd& goal, const Eigen::VectorXd& prior,
                                          double prior_deviation, const Kernel& kernel) const {
  const Eigen::VectorXd g = scaled(goal);
  const double h2 = kernel.style * kernel.style, p2 = prior_deviation * prior_deviation;
  const bool informed = std::isfinite(prior_deviation);
  // the product of two Gaussians is one, at the mean weighted by their precisions
  const double pull = informed ? h2 / (h2 + p2) : 0.0;
  Eigen::VectorXd exponent(style_.rows());
  for (Index i = 0; i < style_.rows(); ++i) {
    exponent[i] = (goals_.row(i).transpose() - g).squaredNorm() / (kernel.goal * kernel.goal);
    if (informed) exponent[i] += (style_.row(i).transpose() - prior).squaredNorm() / (h2 + p2);
  }
  const Eigen::VectorXd weight = (-0.5 * (exponent.array() - exponent.minCoeff())).exp();
  const Eigen::VectorXd mean = style_.transpose() * weight / weight.sum();
  return informed ? Eigen::VectorXd((1.0 - pull) * mean + pull * prior) : mean;
}

}  // namespace mimesis::synthesizer
