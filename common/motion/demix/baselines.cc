#include "common/motion/demix/baselines.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "common/motion/demix/sisa.h"

namespace mimesis::demix {

using Eigen::Index;
using Eigen::MatrixXd;

Mixture principal_components(const mocap::Trials& set, int components) {
  check_set(set);
  check_count(set, components, 0);
  const MatrixXd x = set.samples.colwise() - set.samples.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(x.transpose() * x);
  const MatrixXd sources =  // orthonormal rows, strongest first
      eigen.eigenvectors().rightCols(components).rowwise().reverse().transpose();
  const double rms = std::sqrt(static_cast<double>(sources.cols()));
  Mixture m;
  m.means = set.samples.rowwise().mean();
  m.sources = sources * rms;
  m.weights = (set.samples.colwise() - m.means) * sources.transpose() / rms;
  m.delay_rad = MatrixXd::Zero(m.weights.rows(), m.weights.cols());
  for (Index k = 0; k < m.sources.rows(); ++k) {  // Like sisa(): weights have sums >= 0.
    if (m.weights.col(k).sum() >= 0.0) continue;
    m.weights.col(k) *= -1.0;
    m.sources.row(k) *= -1.0;
  }
  return m;
}

std::int64_t parameter_count(const Mixture& mixture, const mocap::Trials& set, Delays delays) {
  const std::int64_t k = mixture.sources.rows();
  std::int64_t count = mixture.sources.size() + mixture.weights.size();
  if (delays == Delays::free) count += mixture.weights.size();
  if (delays == Delays::tied) count += k * set.rows_per_trial();
  return count;
}

}  // namespace mimesis::demix
