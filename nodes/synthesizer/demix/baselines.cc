#include "nodes/synthesizer/demix/baselines.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <string>

#include "common/error.h"
#include "common/math/circle.h"
#include "nodes/synthesizer/demix/check_set.h"
#include "nodes/synthesizer/demix/spectrum.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd without_means(const mocap::Trials& set) {
  return set.samples.colwise() - set.samples.rowwise().mean();
}

/// A mixture without delays, sources scaled to unit rms.
Mixture instantaneous(const mocap::Trials& set, const MatrixXd& weights, const MatrixXd& sources) {
  Mixture out;
  const VectorXd rms =
      (sources.rowwise().squaredNorm() / static_cast<double>(sources.cols())).cwiseSqrt();
  out.sources = rms.cwiseInverse().asDiagonal() * sources;
  out.weights = weights * rms.asDiagonal();
  out.delay_rad = MatrixXd::Zero(weights.rows(), weights.cols());
  out.means = set.samples.rowwise().mean();
  return out;
}

/// Columns: the first directions of the rows in the space of T samples.
MatrixXd directions(const MatrixXd& x, int count) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(x.transpose() * x);
  MatrixXd out = solver.eigenvectors().rightCols(count).rowwise().reverse();
  for (Index k = 0; k < count; ++k) {  // a sign that does not depend on the solver
    Index at = 0;
    out.col(k).cwiseAbs().maxCoeff(&at);
    if (out(at, k) < 0.0) out.col(k) = -out.col(k);
  }
  return out;
}

/// (BBᵀ)^(−1/2) B: the nearest matrix with orthonormal rows.
MatrixXd orthonormal_rows(const MatrixXd& b) {
  const Eigen::JacobiSVD<MatrixXd> svd(b, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace

Mixture principal_components(const mocap::Trials& set, int sources) {
  check_set(set);
  check_count(set, sources, 0);
  const MatrixXd x = without_means(set), axes = directions(x, sources);
  return instantaneous(set, x * axes, axes.transpose());
}

Mixture independent_components(const mocap::Trials& set, int sources) {
  check_set(set);
  check_count(set, sources, 0);
  const MatrixXd x = without_means(set), axes = directions(x, sources);
  // the axes are white over time already: rows of unit variance
  const auto samples = static_cast<double>(x.cols());
  const MatrixXd white = std::sqrt(samples) * axes.transpose();
  MatrixXd b = MatrixXd::Identity(sources, sources);
  for (int turn = 0; turn < 1000; ++turn) {
    const MatrixXd g = (b * white).array().tanh();
    const VectorXd slope = (1.0 - g.array().square()).rowwise().mean();
    const MatrixXd next =
        orthonormal_rows(g * white.transpose() / samples - slope.asDiagonal() * b);
    const double turned =
        ((next * b.transpose()).diagonal().cwiseAbs().array() - 1.0).abs().maxCoeff();
    b = next;
    if (turned < 1e-10) break;
  }
  return instantaneous(set, x * axes * b.transpose(), b * axes.transpose());
}

Mixture sinusoids(const mocap::Trials& set, int sources) {
  check_set(set);
  const Index samples = set.samples.cols(), most = harmonic_count(samples);
  if (sources < 1 || sources > most) {
    throw ConfigError("demix.sources: " + std::to_string(sources) + ", expected 1 to " +
                      std::to_string(most) + " harmonics of " + std::to_string(samples) +
                      " samples");
  }
  const MatrixXd spectrum = to_spectrum(set.samples, most, most);
  Mixture out;
  out.sources.resize(sources, samples);
  out.weights.resize(set.samples.rows(), sources);
  out.delay_rad.resize(set.samples.rows(), sources);
  out.means = set.samples.rowwise().mean();
  const double unit = std::sqrt(static_cast<double>(samples));
  for (Index k = 0; k < sources; ++k) {
    const auto harmonic = static_cast<double>(k + 1);
    for (Index t = 0; t < samples; ++t) {
      out.sources(k, t) =
          std::sqrt(2.0) *
          std::cos(math::kTwoPi * harmonic * static_cast<double>(t) / static_cast<double>(samples));
    }
    for (Index n = 0; n < spectrum.cols(); ++n) {
      const double re = spectrum(k, n), im = spectrum(most + k, n);
      out.weights(n, k) = std::hypot(re, im) / unit;
      out.delay_rad(n, k) = -std::atan2(im, re) / harmonic;
    }
  }
  return out;
}

Index parameter_count(const mocap::Trials& set, int sources, Delays delays) {
  const Index delayed = delays == Delays::kFree   ? set.samples.rows()
                        : delays == Delays::kTied ? set.rows_per_trial()
                                                  : 0;
  return sources * (set.samples.cols() + set.samples.rows() + delayed);
}

int components_of_equal_size(const mocap::Trials& set, Index parameters) {
  const Index one = parameter_count(set, 1, Delays::kNone);
  return static_cast<int>(std::min(rank(set), (parameters + one - 1) / one));
}

}  // namespace mimesis::demix
