#include "common/motion/demix/check_set.h"

#include <Eigen/Eigenvalues>
#include <string>

#include "common/error.h"
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

}  // namespace

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

void check_given(const Eigen::MatrixXd& sources, const char* what, Index samples) {
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

void check_known(const mocap::Trials& set, const KnownSources& known) {
  if (known.delay_rad.rows() == set.rows_per_trial() &&
      known.delay_rad.cols() == known.sources.rows() && known.delay_rad.allFinite()) {
    return;
  }
  throw ConfigError("demix: delays of the known sources: expected " +
                    std::to_string(set.rows_per_trial()) + "x" +
                    std::to_string(known.sources.rows()) + " finite numbers");
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

}  // namespace mimesis::demix
