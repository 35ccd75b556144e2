#include "common/motion/demix/sisa.h"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "common/error.h"
#include "common/math/circle.h"
#include "common/motion/demix/alternation.h"
#include "common/motion/demix/group_fit.h"
#include "common/motion/demix/spectrum.h"

namespace mimesis::demix {
namespace {

using Eigen::Index;

std::string name_of_row(const mocap::Trials& set, Index n) {
  const Index rows = set.rows_per_trial();
  const mocap::Trial& trial = set.trials[static_cast<std::size_t>(n / rows)];
  return set.rows[static_cast<std::size_t>(n % rows)] + " of trial " + std::to_string(n / rows) +
         " (" + trial.clip + ", cycle " + std::to_string(trial.cycle) + ")";
}

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

constexpr Index kTrialGroups = 220;  // number of free rows in trial runs
constexpr int kTrialTurns = 10;

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
  std::vector<Index> row;  ///< row of the set, for each column
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
    const Index half = rounded_up(harmonics);
    given_spectra_.leftCols(fixed_) = to_spectrum(options.fixed, harmonics, half);
    given_spectra_.rightCols(given_ - fixed_) = to_spectrum(options.known.sources, harmonics, half);
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
    return {groups_.groups, groups_.size, given_, options_.nonnegative, options_.seed};
  }

  MatrixXd given_delays() const {
    MatrixXd phi = MatrixXd::Zero(options_.sources, groups_.groups);
    for (Index g = 0; g < groups_.groups; ++g) {
      const Index row = g % set_.rows_per_trial();
      for (Index k = fixed_; k < given_; ++k) phi(k, g) = options_.known.delay_rad(row, k - fixed_);
    }
    return phi;
  }

  Alternation::Limits limits(int turns) const {
    return {turns, options_.restarts, options_.tolerance};
  }

  void report(double share) const {
    if (options_.progress) options_.progress(std::min(1.0, share));
  }

  /// An alternation from `sources` (the learned ones), delays looked for or 0.
  Alternation from_sources(const MatrixXd& data, const MatrixXd& learned, bool look,
                           const std::vector<Index>& columns) const {
    Alternation::Layout part = layout();
    part.groups = static_cast<Index>(columns.size());
    const Index half = data.rows() / 2;
    Alternation run(data, part);
    run.set_left_out(left_out_ * data.squaredNorm() / full_.squaredNorm());
    MatrixXd sources(data.rows(), options_.sources);
    sources.leftCols(given_) = with_half(given_spectra_, half);
    sources.rightCols(learned.cols()) = learned;
    run.start(sources, given_delays()(Eigen::all, columns));
    if (look) run.search(options_.restarts);
    return run;
  }

  /// Groups for the trial runs: a limited number, evenly from all rows and trials.
  std::vector<Index> sample_of_groups() const {
    Index stride = std::max<Index>(1, groups_.groups / kTrialGroups);
    while (std::gcd(stride, set_.rows_per_trial()) != 1) ++stride;
    std::vector<Index> out;
    for (Index g = 0; g < groups_.groups; g += options_.tied ? 1 : stride) out.push_back(g);
    return out;
  }

  /// Residual of the data without the fixed and known sources.
  MatrixXd left_by_given(const MatrixXd& data) const {
    if (given_ == 0) return data;
    Alternation known(data, layout());
    known.start(with_half(given_spectra_, data.rows() / 2), given_delays().topRows(given_));
    return known.residual();
  }

  struct Candidate {
    double error;
    Alternation run;
    std::vector<double> trace;
  };

  Alternation best_start(std::vector<double>& trace) {
    const Index half = rounded_up(kept_);
    const MatrixXd data = with_half(full_, half);
    left_out_ = removed_energy() - data.squaredNorm();
    const std::vector<Start> all =
        options_.start.rows() > 0
            ? std::vector<Start>{{to_spectrum(options_.start, kept_, half).colwise().normalized()}}
            : starts(left_by_given(data), options_.sources - given_, options_.tied, given_ > 0);
    const std::vector<Index> sample = sample_of_groups();
    const bool whole = static_cast<Index>(sample.size()) == groups_.groups;
    const MatrixXd part = whole ? data : MatrixXd(data(Eigen::all, sample));
    std::vector<Candidate> found;
    for (const Start& start : all) {
      Candidate c{0.0, from_sources(part, start.sources, start.search, sample), {}};
      c.run.run(limits(std::min(kTrialTurns, options_.turns)), &c.trace);
      c.error = c.run.error();
      found.push_back(std::move(c));
      report(0.5 * static_cast<double>(found.size()) / static_cast<double>(all.size()));
    }
    std::ranges::stable_sort(found, {}, &Candidate::error);
    const std::size_t finalists = options_.tied ? static_cast<std::size_t>(options_.finalists) : 1;
    found.erase(found.begin() + static_cast<long>(std::min(finalists, found.size())), found.end());
    std::vector<Index> groups(static_cast<std::size_t>(groups_.groups));
    std::iota(groups.begin(), groups.end(), 0);
    for (Candidate& c : found) {
      if (!whole) {
        c.trace.clear();
        c.run =
            from_sources(data, c.run.sources().rightCols(options_.sources - given_), true, groups);
      }
      c.run.run(limits(options_.turns), &c.trace);
      c.error = c.run.error();
    }
    report(0.9);
    Candidate& best = *std::ranges::min_element(found, {}, &Candidate::error);
    trace = std::move(best.trace);
    return std::move(best.run);
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
  VectorXd scale_;  ///< scales of the given spectra, as given
  Index kept_ = 0;
  double left_out_ = 0.0;  ///< energy of the harmonics above those
};

Mixture Demixing::mixture(const Alternation& from) const {
  const Index count = options_.sources, total = set_.samples.rows();
  Mixture out;
  out.fixed = static_cast<int>(fixed_);
  out.sources.resize(count, samples_);
  if (fixed_ > 0) out.sources.topRows(fixed_) = options_.fixed;
  if (given_ > fixed_) {
    out.sources.middleRows(fixed_, given_ - fixed_) = options_.known.sources;
  }
  out.sources.bottomRows(count - given_) =
      from_spectrum(from.sources().rightCols(count - given_), samples_);
  out.weights.resize(total, count);
  out.delay_rad.resize(total, count);
  for (Index c = 0; c < total; ++c) {
    const Index n = groups_.row[static_cast<std::size_t>(c)];
    out.weights.row(n) = from.weights().col(c).transpose();
    out.weights.row(n).head(given_).array() /= scale_.transpose().array();
    out.delay_rad.row(n) = from.phi().col(c / groups_.size).transpose();
  }
  fix_gauge(out, given_, options_.nonnegative);
  out.means = set_.samples.rowwise().mean() -
              out.weights.leftCols(fixed_) * out.sources.topRows(fixed_).rowwise().mean();
  return out;
}

/// Weights of the 2h + 1 samples for the value in their middle.
VectorXd filter(int half_window, int order) {
  MatrixXd powers(2 * half_window + 1, order + 1);
  for (Index i = 0; i < powers.rows(); ++i) {
    const double x = static_cast<double>(i - half_window) / std::max(1, half_window);
    for (Index j = 0; j <= order; ++j) powers(i, j) = std::pow(x, static_cast<double>(j));
  }
  const MatrixXd unit = MatrixXd::Identity(powers.rows(), powers.rows());
  return powers.colPivHouseholderQr().solve(unit).row(0).transpose();
}

/// `sources` (named `what` in the message) have the set's period and are finite and not constant.
void check_given(const MatrixXd& sources, const char* what, Index samples) {
  if (sources.rows() == 0) return;
  const std::string name = std::string("demix: ") + what + " source";
  if (sources.cols() != samples) {
    throw ConfigError(name + "s have " + std::to_string(sources.cols()) + " samples, expected " +
                      std::to_string(samples) + " as the set");
  }
  for (Index k = 0; k < sources.rows(); ++k) {
    const auto centred = (sources.row(k).array() - sources.row(k).mean()).eval();
    if (sources.row(k).allFinite() && centred.abs().maxCoeff() > 0.0) continue;
    throw ConfigError(name + " " + std::to_string(k) + " is constant or not finite");
  }
}

/// One finite delay for each row of a trial and known source.
void check_known(const mocap::Trials& set, const KnownSources& known) {
  if (known.delay_rad.rows() == set.rows_per_trial() &&
      known.delay_rad.cols() == known.sources.rows() && known.delay_rad.allFinite()) {
    return;
  }
  throw ConfigError("demix: delays of the known sources: expected " +
                    std::to_string(set.rows_per_trial()) + "x" +
                    std::to_string(known.sources.rows()) + " finite numbers");
}

}  // namespace

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

void check_set(const mocap::Trials& set) {
  const Index rows = set.rows_per_trial(), trials = static_cast<Index>(set.trials.size());
  if (rows == 0 || trials == 0) {
    throw ConfigError("demix: the set is empty, expected at least one trial with one row");
  }
  if (set.samples.rows() != rows * trials) {
    throw ConfigError("demix: " + std::to_string(set.samples.rows()) + " trajectories, expected " +
                      std::to_string(trials) + " trials of " + std::to_string(rows) + " rows");
  }
  if (set.samples.cols() < 4) {
    throw ConfigError("demix: " + std::to_string(set.samples.cols()) +
                      " samples a period, expected at least 4");
  }
  for (Index n = 0; n < set.samples.rows(); ++n) {
    for (Index t = 0; t < set.samples.cols(); ++t) {
      if (std::isfinite(set.samples(n, t))) continue;
      throw ConfigError("demix: " + name_of_row(set, n) + ": sample " + std::to_string(t) +
                        " is not a finite number");
    }
  }
  if (rank(set) == 0) throw ConfigError("demix: all rows are constant, expected motion");
}

Index rank(const mocap::Trials& set) {
  const Index samples = set.samples.cols(), harmonics = harmonic_count(samples);
  const Eigen::MatrixXd spectrum = to_spectrum(set.samples, harmonics, harmonics);
  const bool tall = spectrum.cols() > spectrum.rows();
  const Eigen::MatrixXd product =
      tall ? Eigen::MatrixXd(spectrum * spectrum.transpose()) : spectrum.transpose() * spectrum;
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(product, Eigen::EigenvaluesOnly).eigenvalues();
  // below: rounding of the product, and of samples that are constant but for it
  const double scale = set.samples.squaredNorm();
  const double least = std::max(1e-13 * values.maxCoeff(), 1e-28 * scale);
  return (values.array() > least).count();
}

void check_count(const mocap::Trials& set, int sources, int given) {
  if (sources < 1 || sources < given) {
    throw ConfigError("demix.sources: " + std::to_string(sources) + ", expected at least " +
                      std::to_string(std::max(1, given)));
  }
  const Index most = rank(set) + given;
  if (sources > most) {
    throw ConfigError("demix.sources: " + std::to_string(sources) +
                      " is more than the set supports, expected at most " + std::to_string(most) +
                      ": so many components describe it exactly");
  }
}

SisaResult sisa(const mocap::Trials& set, const SisaOptions& options) {
  check_set(set);
  const Index samples = set.samples.cols();
  check_given(options.fixed, "fixed", samples);
  check_given(options.known.sources, "known", samples);
  if (options.known.sources.rows() > 0) check_known(set, options.known);
  const Index given = options.fixed.rows() + options.known.sources.rows();
  check_count(set, options.sources, static_cast<int>(given));
  check_given(options.start, "start", samples);
  MIMESIS_ASSERT(options.start.rows() == 0 || options.start.rows() + given == options.sources);
  return Demixing(set, options).run();
}

MatrixXd non_periodic(int count, Index samples) {
  MatrixXd out(count, samples);
  for (Index t = 0; t < samples; ++t) {
    const double angle = 0.5 * math::kTwoPi * static_cast<double>(t) / static_cast<double>(samples);
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
  MIMESIS_ASSERT(mixture.weights.rows() == set.samples.rows() &&
                 mixture.sources.cols() == set.samples.cols());
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

Mixture without_delays(const mocap::Trials& set, const MatrixXd& sources) {
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

Mixture principal_components(const mocap::Trials& set, int components) {
  check_set(set);
  check_count(set, components, 0);
  const MatrixXd x = set.samples.colwise() - set.samples.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(x.transpose() * x);
  return without_delays(set,
                        eigen.eigenvectors().rightCols(components).rowwise().reverse().transpose());
}

std::int64_t parameter_count(const Mixture& mixture, const mocap::Trials& set, Delays delays) {
  const std::int64_t k = mixture.sources.rows();
  std::int64_t count = mixture.sources.size() + mixture.weights.size();
  if (delays == Delays::free) count += mixture.weights.size();
  if (delays == Delays::tied) count += k * set.rows_per_trial();
  return count;
}

}  // namespace mimesis::demix
