#include "nodes/synthesizer/demix/sisa.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/math/circle.h"
#include "nodes/synthesizer/demix/alternation.h"
#include "nodes/synthesizer/demix/check_set.h"
#include "nodes/synthesizer/demix/spectrum.h"
#include "nodes/synthesizer/demix/starts.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Harmonics above the last one of these hold a millionth of the energy: they are left to the end.
Index harmonics_that_matter(const MatrixXd& spectrum, Index harmonics) {
  const Index half = spectrum.rows() / 2;
  VectorXd energy = spectrum.rowwise().squaredNorm();
  energy.head(half) += energy.tail(half).eval();
  const double allowed = 1e-6 * energy.head(half).sum();
  double left_out = 0.0;
  Index count = harmonics;
  while (count > 1 && left_out + energy[count - 1] <= allowed) left_out += energy[--count];
  return count;
}

Index rounded_up(Index harmonics) { return (harmonics + 3) / 4 * 4; }

MatrixXd with_half(const MatrixXd& spectrum, Index half) {
  const Index common = std::min(half, spectrum.rows() / 2);
  MatrixXd out = MatrixXd::Zero(2 * half, spectrum.cols());
  out.topRows(common) = spectrum.topRows(common);
  out.middleRows(half, common) = spectrum.middleRows(spectrum.rows() / 2, common);
  return out;
}

/// Where a set's rows go: groups of trajectories that share their delays, side by side.
struct Grouping {
  Index groups, size;
  std::vector<Index> row;  ///< of the set, for each column
};

Grouping grouping(const mocap::Trials& set, bool tied) {
  const Index total = set.samples.rows(), rows = set.rows_per_trial();
  Grouping out{tied ? rows : total, tied ? total / rows : 1, {}};
  out.row.resize(static_cast<std::size_t>(total));
  for (Index c = 0; c < total; ++c) {
    out.row[static_cast<std::size_t>(c)] = tied ? c % out.size * rows + c / out.size : c;
  }
  return out;
}

class Demixing {
 public:
  Demixing(const mocap::Trials& set, const SisaOptions& options)
      : set_(set),
        options_(options),
        groups_(grouping(set, options.tied)),
        samples_(set.samples.cols()),
        fixed_(options.fixed.rows()),
        given_(fixed_ + options.known.sources.rows()) {
    const Index harmonics = harmonic_count(samples_);
    full_ = to_spectrum(set.samples(groups_.row, Eigen::all), harmonics, rounded_up(harmonics));
    given_spectra_ = MatrixXd(full_.rows(), given_);
    given_spectra_ << to_spectrum(options.fixed, harmonics, rounded_up(harmonics)),
        to_spectrum(options.known.sources, harmonics, rounded_up(harmonics));
    scale_ = given_spectra_.colwise().norm().cwiseMax(1e-300);
    given_spectra_ *= scale_.cwiseInverse().asDiagonal();
    kept_ = harmonics_that_matter(full_, harmonics);
  }

  SisaResult run() {
    SisaResult result;
    const Alternation best = over_all_harmonics(best_start(result.trace));
    result.mixture = mixture(best);
    const MatrixXd x_hat = result.mixture.reconstruct();
    result.quality = demix::quality(set_.samples, x_hat);
    result.quality_squared = demix::quality_squared(set_.samples, x_hat);
    return result;
  }

 private:
  Alternation::Layout layout() const {
    return {groups_.groups, groups_.size, given_, options_.nonnegative};
  }

  MatrixXd given_delays() const {
    MatrixXd phi = MatrixXd::Zero(options_.sources, groups_.groups);
    for (Index g = 0; g < groups_.groups; ++g) {
      const Index row = g % set_.rows_per_trial();
      for (Index k = fixed_; k < given_; ++k) phi(k, g) = options_.known.delay_rad(row, k - fixed_);
    }
    return phi;
  }

  void report(double share) const {
    if (options_.progress) options_.progress(std::min(1.0, share));
  }

  Alternation best_start(std::vector<double>& trace) {
    const Index half = rounded_up(kept_);
    const MatrixXd data = with_half(full_, half), given = with_half(given_spectra_, half);
    const double left_out = removed_energy() - data.squaredNorm();
    const std::vector<Start> all = starts(data, given, options_.sources - given_, options_.tied);
    std::vector<Alternation> runs;
    std::vector<std::vector<double>> traces(all.size());
    const int trial_turns = all.size() == 1 ? options_.turns : std::min(10, options_.turns);
    for (std::size_t i = 0; i < all.size(); ++i) {
      Alternation& run = runs.emplace_back(data, layout());
      run.set_left_out(left_out);
      MatrixXd sources(data.rows(), options_.sources);
      sources << given, all[i].sources;
      run.start(sources, given_delays());
      if (all[i].search) {
        run.search();
        run.search();
      }
      run.run(trial_turns, options_.search_every, options_.tolerance, &traces[i]);
      report(0.6 * static_cast<double>(i + 1) / static_cast<double>(all.size()));
    }
    std::vector<std::size_t> order(all.size());
    std::iota(order.begin(), order.end(), 0);
    std::ranges::stable_sort(order, {}, [&](std::size_t i) { return runs[i].error(); });
    if (all.size() > 1) {
      order.resize(std::min(order.size(), static_cast<std::size_t>(options_.finalists)));
      for (const std::size_t i : order) {
        runs[i].run(options_.turns, options_.search_every, options_.tolerance, &traces[i]);
      }
    }
    report(0.9);
    const std::size_t best =
        *std::ranges::min_element(order, {}, [&](std::size_t i) { return runs[i].error(); });
    trace = traces[best];
    return runs[best];
  }

  /// Energy of the rows with their means removed.
  double removed_energy() const {
    return (set_.samples.colwise() - set_.samples.rowwise().mean()).squaredNorm();
  }

  Alternation over_all_harmonics(const Alternation& from) const {
    Alternation out(full_, layout());
    MatrixXd sources = with_half(from.sources(), full_.rows() / 2);
    sources.leftCols(given_) = given_spectra_;
    out.start(sources, from.phi());
    for (int i = 0; i < 2; ++i) {
      out.update_sources();
      out.refine(1);
    }
    return out;
  }

  Mixture mixture(const Alternation& from) const;

  const mocap::Trials& set_;
  const SisaOptions& options_;
  Grouping groups_;
  Index samples_, fixed_, given_;
  MatrixXd full_, given_spectra_;
  VectorXd scale_;  ///< norms of the given spectra, as given
  Index kept_ = 0;
};

/// The phase by which a learned source is advanced: its gauge (sisa.h).
double gauge(const Eigen::Ref<const VectorXd>& spectrum) {
  const Index half = spectrum.size() / 2;
  Index dominant = 0;
  (spectrum.head(half).array().square() + spectrum.tail(half).array().square()).maxCoeff(&dominant);
  const double order = static_cast<double>(dominant + 1);
  const double phase = std::atan2(spectrum[half + dominant], spectrum[dominant]);
  // of the shifts that bring a crest of the dominant harmonic to t = 0, the highest s(0)
  double best = 0.0, highest = -INFINITY;
  for (Index i = 0; i <= dominant; ++i) {
    const double shift = (-phase + math::kTwoPi * static_cast<double>(i)) / order;
    double at_zero = 0.0;
    for (Index f = 0; f < half; ++f) {
      const double angle = static_cast<double>(f + 1) * shift;
      at_zero += spectrum[f] * std::cos(angle) - spectrum[half + f] * std::sin(angle);
    }
    if (at_zero > highest + 1e-12) {
      highest = at_zero;
      best = shift;
    }
  }
  return best;
}

Mixture Demixing::mixture(const Alternation& from) const {
  const Index count = options_.sources, total = set_.samples.rows();
  Mixture out;
  out.fixed = static_cast<int>(fixed_);
  out.weights = MatrixXd(total, count);
  out.delay_rad = MatrixXd(total, count);
  out.sources = MatrixXd(count, samples_);
  out.sources.topRows(fixed_) = options_.fixed;
  out.sources.middleRows(fixed_, given_ - fixed_) = options_.known.sources;
  std::vector<Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  const VectorXd carried = from.weights().rowwise().squaredNorm();
  std::stable_sort(order.begin() + given_, order.end(),
                   [&](Index a, Index b) { return carried[a] > carried[b]; });
  const double unit = std::sqrt(static_cast<double>(samples_));  // norm of unit rms
  for (Index k = 0; k < count; ++k) {
    const Index j = order[static_cast<std::size_t>(k)];
    double factor = j < given_ ? 1.0 / scale_[j] : 1.0 / unit, advance = 0.0;
    if (j >= given_) {
      VectorXd spectrum = from.sources().col(j);
      if (!options_.nonnegative && from.weights().row(j).sum() < 0.0) {
        spectrum = -spectrum;
        factor = -factor;
      }
      advance = gauge(spectrum);
      const Index half = spectrum.size() / 2;
      for (Index f = 0; f < half; ++f) {
        const double angle = static_cast<double>(f + 1) * advance;
        const double re = spectrum[f], im = spectrum[half + f];
        spectrum[f] = re * std::cos(angle) - im * std::sin(angle);
        spectrum[half + f] = re * std::sin(angle) + im * std::cos(angle);
      }
      out.sources.row(k) = unit * from_spectrum(spectrum, samples_);
    }
    for (Index c = 0; c < total; ++c) {
      const Index n = groups_.row[static_cast<std::size_t>(c)];
      out.weights(n, k) = factor * from.weights()(j, c);
      out.delay_rad(n, k) = math::wrap_pi(from.phi()(j, c / groups_.size) + advance);
    }
  }
  for (Index c = 0; c < total; c += groups_.size) {  // a delay of nothing is 0
    for (Index k = given_; k < count; ++k) {
      const Index j = order[static_cast<std::size_t>(k)];
      if (!from.weights().row(j).segment(c, groups_.size).isZero(0.0)) continue;
      for (Index i = c; i < c + groups_.size; ++i) {
        out.delay_rad(groups_.row[static_cast<std::size_t>(i)], k) = 0.0;
      }
    }
  }
  out.means = set_.samples.rowwise().mean() -
              out.weights.leftCols(fixed_) * out.sources.topRows(fixed_).rowwise().mean();
  return out;
}

}  // namespace

SisaResult sisa(const mocap::Trials& set, const SisaOptions& options) {
  check_set(set);
  const Index samples = set.samples.cols();
  check_given(options.fixed, "fixed", samples);
  check_given(options.known.sources, "known", samples);
  if (options.known.sources.rows() > 0) check_known(set, options.known);
  check_count(set, options.sources,
              static_cast<int>(options.fixed.rows() + options.known.sources.rows()));
  return Demixing(set, options).run();
}

MatrixXd non_periodic(int count, Index samples) {
  MatrixXd out(count, samples);
  for (Index t = 0; t < samples; ++t) {
    const double angle =
        0.5 * math::kTwoPi * static_cast<double>(t + 1) / static_cast<double>(samples);
    if (count > 0) out(0, t) = std::cos(angle);
    if (count > 1) out(1, t) = std::cos(0.5 * angle);
    if (count > 2) out(2, t) = std::sin(0.5 * angle);
  }
  return out;
}

KnownSources known_sources(const Mixture& tied, Index rows_per_trial) {
  const Index periodic = tied.sources.rows() - tied.fixed;
  return {tied.sources.bottomRows(periodic),
          tied.delay_rad.topRows(rows_per_trial).rightCols(periodic)};
}

}  // namespace mimesis::demix
