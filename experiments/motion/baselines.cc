#include "experiments/motion/baselines.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>
#include <vector>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/motion/demix/sisa.h"
#include "common/motion/demix/spectrum.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

/// The nearest matrix with orthonormal rows.
MatrixXd orthonormal(const MatrixXd& w) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(w * w.transpose());
  return eigen.operatorInverseSqrt() * w;
}

}  // namespace

// Hyvärinen 1999: w ← E{z g(wᵀz)} − E{g'(wᵀz)} w with g = tanh, all rows at once.
Mixture independent_components(const mocap::Trials& set, int components, int turns) {
  const Mixture pca = principal_components(set, components);
  const MatrixXd rows = pca.sources / std::sqrt(static_cast<double>(pca.sources.cols()));
  const auto samples = static_cast<double>(rows.cols());
  const MatrixXd z = rows * std::sqrt(samples);  // white: unit variance, uncorrelated
  MatrixXd w = MatrixXd::Identity(components, components);
  for (int turn = 0; turn < turns; ++turn) {
    const MatrixXd g = (w * z).array().tanh();
    const Eigen::VectorXd slope = (1.0 - g.array().square()).rowwise().mean();
    const MatrixXd next = orthonormal(g * z.transpose() / samples - slope.asDiagonal() * w);
    const double change = (1.0 - (next * w.transpose()).diagonal().array().abs()).abs().maxCoeff();
    w = next;
    if (change < 1e-9) break;
  }
  const MatrixXd sources = w * rows;
  const Eigen::VectorXd energy =
      ((set.samples.colwise() - set.samples.rowwise().mean()) * sources.transpose())
          .colwise()
          .squaredNorm();
  std::vector<Index> order(static_cast<std::size_t>(components));
  std::iota(order.begin(), order.end(), Index{0});
  std::ranges::stable_sort(order, [&](Index a, Index b) { return energy[a] > energy[b]; });
  return without_delays(set, sources(order, Eigen::all));
}

Mixture sinusoids(const mocap::Trials& set, int harmonics) {
  check_set(set);
  const Index samples = set.samples.cols(), count = set.samples.rows();
  if (harmonics < 1 || harmonics > harmonic_count(samples)) {
    throw ConfigError("sinusoids: " + std::to_string(harmonics) + " harmonics, expected 1 to " +
                      std::to_string(harmonic_count(samples)));
  }
  Mixture m;
  m.means = set.samples.rowwise().mean();
  m.sources.resize(harmonics, samples);
  m.weights.resize(count, harmonics);
  m.delay_rad.resize(count, harmonics);
  const Index half = harmonic_count(samples);
  const MatrixXd spectrum = to_spectrum(set.samples, half, half);
  for (Index k = 0; k < harmonics; ++k) {
    for (Index t = 0; t < samples; ++t) {
      m.sources(k, t) = std::sqrt(2.0) * std::cos(math::kTwoPi * static_cast<double>((k + 1) * t) /
                                                  static_cast<double>(samples));
    }
    for (Index n = 0; n < count; ++n) {
      // x = √(2/T)(a cos hφ − b sin hφ) = r √(2/T) cos(h(φ − φ₀)), φ₀ = −arg(a + ib)/h
      const std::complex<double> c(spectrum(k, n), spectrum(half + k, n));
      m.weights(n, k) = std::abs(c) / std::sqrt(static_cast<double>(samples));
      m.delay_rad(n, k) = -std::arg(c) / static_cast<double>(k + 1);
    }
  }
  return m;
}

int components_of_equal_size(const mocap::Trials& set, std::int64_t parameters) {
  const auto each = static_cast<double>(set.samples.rows() + set.samples.cols());
  const long nearest = std::lround(static_cast<double>(parameters) / each);
  return static_cast<int>(std::clamp(nearest, 1L, static_cast<long>(set.samples.cols())));
}

}  // namespace mimesis::demix
