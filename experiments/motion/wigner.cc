#include "experiments/motion/wigner.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "common/math/circle.h"
#include "common/motion/demix/alternation.h"
#include "common/motion/demix/spectrum.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kTiny = 1e-12;  // share of the mean power: factors stay above 0

class Wigner {
 public:
  Wigner(const mocap::Trials& set, const WignerOptions& options)
      : set_(set),
        options_(options),
        harmonics_(harmonic_count(set.samples.cols())),
        half_((harmonics_ + 3) / 4 * 4),
        spectrum_(to_spectrum(set.samples, harmonics_, half_)),
        power_(spectrum_.topRows(harmonics_).cwiseAbs2() +
               spectrum_.middleRows(half_, harmonics_).cwiseAbs2()),
        phase_(harmonics_, spectrum_.cols()) {
    for (Index n = 0; n < spectrum_.cols(); ++n) {
      for (Index f = 0; f < harmonics_; ++f) {
        phase_(f, n) = std::atan2(spectrum_(half_ + f, n), spectrum_(f, n));
      }
    }
    start_factors();
  }

  SisaResult run() {
    Alternation fit(spectrum_, {.groups = spectrum_.cols()});
    const double energy = (set_.samples.colwise() - set_.samples.rowwise().mean()).squaredNorm();
    MatrixXd delays = start_delays(), best_sources, best_delays, best_weights;
    double least = INFINITY;
    SisaResult result;
    for (int turn = 0; turn < options_.turns; ++turn) {
      factorise();
      update_phases(delays);
      const MatrixXd sources = source_spectra();
      fit.start(sources, delays);
      fit.search(2);
      delays = fit.phi();
      squared_weights_ = fit.weights().cwiseAbs2().cwiseMax(kTiny * power_.mean());
      if (fit.error() < least) {
        least = fit.error();
        best_sources = sources;
        best_delays = delays;
        best_weights = fit.weights();
      }
      result.trace.push_back(1.0 - std::sqrt((least + energy - spectrum_.squaredNorm()) / energy));
    }
    Mixture& m = result.mixture;
    m.sources = from_spectrum(best_sources, set_.samples.cols());
    m.weights = best_weights.transpose();
    m.delay_rad = best_delays.transpose();
    m.means = set_.samples.rowwise().mean();
    fix_gauge(m, 0, false);
    const MatrixXd x_hat = m.reconstruct();
    result.quality = quality(set_.samples, x_hat);
    result.quality_squared = quality_squared(set_.samples, x_hat);
    return result;
  }

 private:
  /// Source k mostly harmonic k + 1: where SISA starts too.
  void start_factors() {
    source_power_ = MatrixXd::Constant(harmonics_, options_.sources, 0.05);
    for (Index k = 0; k < options_.sources; ++k) source_power_(k % harmonics_, k) = 1.0;
    squared_weights_ =
        MatrixXd::Constant(options_.sources, power_.cols(), std::max(kTiny, power_.mean()));
    source_phase_ = MatrixXd::Zero(harmonics_, options_.sources);
  }

  MatrixXd start_delays() const {
    MatrixXd delays(options_.sources, phase_.cols());
    for (Index k = 0; k < options_.sources; ++k) {
      const Index f = k % harmonics_;
      delays.row(k) = -phase_.row(f) / static_cast<double>(f + 1);
    }
    return delays;
  }

  /// (3.6): P (F×N) ≈ B·A, both ≥ 0, multiplicative updates of the squared error [Lee & Seung].
  void factorise() {
    const double floor = kTiny * std::max(kTiny, power_.mean());
    for (int i = 0; i < options_.factor_turns; ++i) {
      const MatrixXd ata = squared_weights_ * squared_weights_.transpose();
      source_power_.array() *= (power_ * squared_weights_.transpose()).array() /
                               (source_power_ * ata).array().max(floor);
      const MatrixXd btb = source_power_.transpose() * source_power_;
      squared_weights_.array() *= (source_power_.transpose() * power_).array() /
                                  (btb * squared_weights_).array().max(floor);
    }
    for (Index k = 0; k < options_.sources; ++k) {  // unit energy of sources
      const double energy = std::max(floor, source_power_.col(k).sum());
      source_power_.col(k) /= energy;
      squared_weights_.row(k) *= energy;
    }
  }

  /// (3.7) between neighbouring harmonics, for the slopes of the sources' phases.
  void update_phases(const MatrixXd& delays) {
    const Index count = options_.sources, rows = power_.cols();
    MatrixXd slope(std::max<Index>(0, harmonics_ - 1), count);
    for (Index f = 0; f + 1 < harmonics_; ++f) {
      slope.row(f) = source_phase_.row(f + 1) - source_phase_.row(f);
    }
    for (Index f = 0; f + 1 < harmonics_; ++f) {
      const VectorXd between =
          (source_power_.row(f).cwiseProduct(source_power_.row(f + 1))).cwiseSqrt();
      MatrixXd normal = MatrixXd::Zero(count, count);
      VectorXd right = VectorXd::Zero(count);
      for (Index n = 0; n < rows; ++n) {
        const VectorXd part = squared_weights_.col(n).cwiseProduct(between);
        const double whole = part.sum();
        if (whole <= 0.0) continue;
        const double predicted = part.dot(slope.row(f).transpose() - delays.col(n)) / whole;
        const double miss = math::wrap_pi(phase_(f + 1, n) - phase_(f, n) - predicted);
        normal += part * part.transpose();
        right += part * whole * miss;
      }
      normal.diagonal().array() += 1e-9 * normal.trace() + 1e-300;
      slope.row(f) += normal.ldlt().solve(right).transpose();
    }
    for (Index k = 0; k < count; ++k) {
      for (Index f = 1; f < harmonics_; ++f) {
        source_phase_(f, k) = source_phase_(f - 1, k) + math::wrap_pi(slope(f - 1, k));
      }
    }
  }

  MatrixXd source_spectra() const {
    MatrixXd out = MatrixXd::Zero(2 * half_, options_.sources);
    const auto amplitude = source_power_.cwiseSqrt().array();
    out.topRows(harmonics_) = amplitude * source_phase_.array().cos();
    out.middleRows(half_, harmonics_) = amplitude * source_phase_.array().sin();
    return out;
  }

  const mocap::Trials& set_;
  const WignerOptions& options_;
  Index harmonics_, half_;
  MatrixXd spectrum_;                     ///< 2·half × N
  MatrixXd power_, phase_;                ///< F×N
  MatrixXd source_power_, source_phase_;  ///< F×K
  MatrixXd squared_weights_;              ///< K×N
};

}  // namespace

SisaResult wigner(const mocap::Trials& set, const WignerOptions& options) {
  check_set(set);
  check_count(set, options.sources, 0);
  return Wigner(set, options).run();
}

}  // namespace mimesis::demix
