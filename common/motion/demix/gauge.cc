#include "common/motion/demix/gauge.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "common/math/circle.h"
#include "common/motion/demix/shift_kernels.h"
#include "common/motion/demix/spectrum.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// The phase by which a source has to be delayed.
double turn_to_crest(const VectorXd& spectrum) {
  const Index half = spectrum.size() / 2;
  Index dominant = 0;
  (spectrum.head(half).array().square() + spectrum.tail(half).array().square()).maxCoeff(&dominant);
  const auto order = static_cast<double>(dominant + 1);
  const double phase = std::atan2(spectrum[half + dominant], spectrum[dominant]);
  double best = 0.0, highest = -INFINITY;
  VectorXd turned(2 * half);
  for (Index i = 0; i <= dominant; ++i) {
    const double delay = (phase + math::kTwoPi * static_cast<double>(i)) / order;
    shift_spectrum(spectrum.data(), delay, half, turned.data(), nullptr);
    const double at_zero = turned.head(half).sum();
    if (at_zero > highest + 1e-9) {
      highest = at_zero;
      best = delay;
    }
  }
  return best;
}

void turn_and_scale(Mixture& m, Index k, bool keep_sign) {
  const Index samples = m.sources.cols(), harmonics = harmonic_count(samples);
  const Index half = (harmonics + 3) / 4 * 4;
  VectorXd spectrum = to_spectrum(m.sources.row(k), harmonics, half), turned(2 * half);
  double scale = spectrum.norm() / std::sqrt(static_cast<double>(samples));
  if (scale <= 0.0) return;
  if (!keep_sign && m.weights.col(k).sum() < 0.0) scale = -scale;
  spectrum /= scale;
  const double delay = turn_to_crest(spectrum);
  shift_spectrum(spectrum.data(), delay, half, turned.data(), nullptr);
  m.sources.row(k) = from_spectrum(turned, samples);
  m.weights.col(k) *= scale;
  m.delay_rad.col(k).array() -= delay;
}

}  // namespace

void fix_gauge(Mixture& mixture, Index given, bool keep_signs) {
  const Index count = mixture.sources.rows();
  for (Index k = given; k < count; ++k) turn_and_scale(mixture, k, keep_signs);
  std::vector<Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  const VectorXd carried = mixture.weights.colwise().squaredNorm();
  std::stable_sort(order.begin() + given, order.end(),
                   [&](Index a, Index b) { return carried[a] > carried[b]; });
  mixture.sources = mixture.sources(order, Eigen::all).eval();
  mixture.weights = mixture.weights(Eigen::all, order).eval();
  mixture.delay_rad = mixture.delay_rad(Eigen::all, order).eval();
  for (Index k = given; k < count; ++k) {
    for (Index n = 0; n < mixture.weights.rows(); ++n) {
      mixture.delay_rad(n, k) =
          mixture.weights(n, k) == 0.0 ? 0.0 : math::wrap_pi(mixture.delay_rad(n, k));
    }
  }
}

}  // namespace mimesis::demix
