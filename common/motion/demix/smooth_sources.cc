#include "common/motion/demix/smooth_sources.h"

#include <Eigen/QR>
#include <cmath>
#include <string>

#include "common/error.h"
#include "common/motion/demix/check_set.h"
#include "common/motion/demix/group_fit.h"
#include "common/motion/demix/spectrum.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What each of the 2h + 1 samples counts for the value in their middle.
VectorXd filter(int half_window, int order) {
  MatrixXd powers(2 * half_window + 1, order + 1);
  for (Index i = 0; i < powers.rows(); ++i) {
    const double x = static_cast<double>(i - half_window) / std::max(1, half_window);
    for (Index j = 0; j <= order; ++j) powers(i, j) = std::pow(x, static_cast<double>(j));
  }
  const MatrixXd unit = MatrixXd::Identity(powers.rows(), powers.rows());
  return powers.colPivHouseholderQr().solve(unit).row(0).transpose();
}

/// Weights of all rows, for sources and delays as they are.
void fit_weights(const mocap::Trials& set, bool nonnegative, Mixture& m) {
  const Index harmonics = harmonic_count(set.samples.cols()), half = (harmonics + 3) / 4 * 4;
  const MatrixXd data = to_spectrum(set.samples, harmonics, half);
  const Index count = m.source_count();
  GroupFit fit(half, count, 1, count, nonnegative);
  fit.set_sources(to_spectrum(m.sources, harmonics, half));
  VectorXd phi(count), w(count);
  for (Index n = 0; n < data.cols(); ++n) {
    phi = m.delay_rad.row(n).transpose();
    fit.weights(data.col(n).data(), data.col(n).squaredNorm(), phi.data(), w.data());
    m.weights.row(n) = w.transpose();
  }
  m.means = set.samples.rowwise().mean() -
            m.weights.leftCols(m.fixed) * m.sources.topRows(m.fixed).rowwise().mean();
}

}  // namespace

MatrixXd savitzky_golay(const MatrixXd& rows, int half_window, int order) {
  const Index samples = rows.cols();
  if (half_window < 0 || order < 0 || order >= 2 * half_window + 1 ||
      2 * half_window + 1 > samples) {
    throw ConfigError("smoothing: order " + std::to_string(order) + " and half window " +
                      std::to_string(half_window) + ", expected 0 <= order < 2 x half window + 1 " +
                      "<= " + std::to_string(samples) + " samples");
  }
  const VectorXd taps = filter(half_window, order);
  MatrixXd out = MatrixXd::Zero(rows.rows(), samples);
  for (Index t = 0; t < samples; ++t) {
    for (Index i = -half_window; i <= half_window; ++i) {
      out.col(t) += taps[half_window + i] * rows.col((t + i + samples) % samples);
    }
  }
  return out;
}

SisaResult smooth_sources(const mocap::Trials& set, const Mixture& mixture,
                          const SmoothOptions& options) {
  check_set(set);
  if (mixture.weights.rows() != set.samples.rows() ||
      mixture.sources.cols() != set.samples.cols()) {
    throw ConfigError("smoothing: a mixture of " + std::to_string(mixture.weights.rows()) +
                      " rows and " + std::to_string(mixture.sources.cols()) +
                      " samples, expected those of the set: " + std::to_string(set.samples.rows()) +
                      " and " + std::to_string(set.samples.cols()));
  }
  SisaResult out{mixture, {}, 0.0, 0.0};
  Mixture& m = out.mixture;
  const Index learned = m.source_count() - m.fixed;
  auto sources = m.sources.bottomRows(learned);
  sources = savitzky_golay(sources, options.half_window, options.order);
  for (Index k = 0; k < learned; ++k) {
    const double rms =
        std::sqrt(sources.row(k).squaredNorm() / static_cast<double>(sources.cols()));
    if (rms > 0.0) sources.row(k) /= rms;
  }
  fit_weights(set, options.nonnegative, m);
  const MatrixXd x_hat = m.reconstruct();
  out.quality = quality(set.samples, x_hat);
  out.quality_squared = quality_squared(set.samples, x_hat);
  return out;
}

}  // namespace mimesis::demix
