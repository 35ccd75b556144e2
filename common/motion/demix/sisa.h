#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <vector>

#include "common/motion/demix/mixture.h"
#include "common/motion/mocap/trials.h"

namespace mimesis::demix {

/// Sources that are given with their delays, learned from an earlier action.
struct KnownSources {
  Eigen::MatrixXd sources;    ///< K₀×T, periodic
  Eigen::MatrixXd delay_rad;  ///< R×K₀, one per row of a trial and source
};

struct SisaOptions {
  /// K, all of them: `fixed` and `known` count.
  int sources = 4;
  /// One delay per row of a trial and source, the same in all trials; else one per trajectory.
  bool tied = false;
  bool nonnegative = false;
  /// Non-periodic sources, rows of T samples: given, not shifted. [M18 3.3.3]: non_periodic().
  Eigen::MatrixXd fixed = {};
  /// Stepwise regression: these follow the fixed ones unchanged; their weights are estimated again
  /// and the other sources are learned from the residual. @see known_sources()
  KnownSources known = {};
  /// Sources that the learned ones start from instead of harmonics, rows of T samples: those of a
  /// set that differs little (held_out()). Empty: none.
  Eigen::MatrixXd start = {};
  int turns = 40;           ///< largest number of alternations (τ, W, S), for each start
  int restarts = 2;         ///< random delays each row starts from in every turn, beside its own
  double tolerance = 1e-4;  ///< a turn that gains less of Q is the last
  /// Seed of the random delays: another seed may end in another local minimum.
  std::uint32_t seed = 1;
  /// Tied delays have many local minima: number of starts that are followed to their ends.
  int finalists = 2;
  /// Called with the share of the work done, 0..1; may be empty.
  std::function<void(double)> progress = {};
};

struct SisaResult {
  Mixture mixture;            ///< N weights and delays, in the order of the set's rows
  std::vector<double> trace;  ///< Q after every turn, of the start that won; does not fall
  double quality = 0.0, quality_squared = 0.0;  ///< Q, Q2 of the mixture
};

/// Shift Invariant Subspace Analysis [M18 eq. 3.8-3.10]: sources, weights and delays of the
/// anechoic mixture that is nearest to the set in the least-squares sense. Starts from harmonics,
/// with tied delays also from the principal components (the mixture without delays), so that it is
/// never worse than those. Delays are not bound to samples.
///
/// Learned sources have unit rms, are turned so that their strongest harmonic has its crest at
/// t = 0, signed so that their weights sum up to ≥ 0, and come in the order of the energy they
/// carry (fix_gauge()); fixed and known ones stay as given.
/// A constant row has weights 0. Deterministic. Time O(turns·N·T·K²).
/// @throws ConfigError: no rows or trials, a number that is not finite (names the row), sources
/// that do not fit the period, more sources than the set supports (its rank: as many principal
/// components describe it exactly)
SisaResult sisa(const mocap::Trials& set, const SisaOptions& options);

/// The `count` (1..3) non-periodic sources of [M18 3.3.3], t = 0..T−1: cos(πt/T), cos(πt/2T),
/// sin(πt/2T). (The text counts t = 1..T; then the first would be cos(φ/2) but for one sample, and
/// transitions [M18 after eq. 3.23] need it exactly.)
Eigen::MatrixXd non_periodic(int count, Eigen::Index samples);

/// The periodic sources of a tied mixture with their delays, for another action.
KnownSources known_sources(const Mixture& tied, Eigen::Index rows_per_trial);

/// Savitzky-Golay filter of periodic rows (R×T): each value becomes that of the polynomial of
/// `order` that is nearest to it and to the `half_window` samples on either side.
/// @throws ConfigError unless 0 <= order < 2·half_window + 1 <= T
Eigen::MatrixXd savitzky_golay(const Eigen::MatrixXd& rows, int half_window, int order);

struct SmoothOptions {
  int half_window = 3;  ///< samples
  int order = 3;
  bool nonnegative = false;  ///< weights, as in SisaOptions
};

/// Learned sources are continuous, but may have kinks. They are smoothed by savitzky_golay(), get
/// unit rms again, and the weights are estimated again; delays and the fixed sources stay [M18
/// 3.3.3]. Q falls a little. The trace is empty.
/// @throws ConfigError for the window, as sisa() for the set, or if the mixture is not of the set
SisaResult smooth_sources(const mocap::Trials& set, const Mixture& mixture,
                          const SmoothOptions& options);

/// Weights and means of all rows by least squares, for sources and delays as they are.
void fit_weights(const mocap::Trials& set, bool nonnegative, Mixture& m);

// Checks of the input that all demixing methods share. All throw ConfigError in one line.

/// Trials and rows are there, the sizes fit, at least 4 samples, all finite, not all constant.
void check_set(const mocap::Trials& set);
/// 1 ≤ K ≤ rank of the set, and at least `given`.
void check_count(const mocap::Trials& set, int sources, int given);

/// Independent rows of the set, means and Nyquist bin removed, as far as rounding lets one see.
Eigen::Index rank(const mocap::Trials& set);

/// A mixture without delays. @param sources  orthonormal rows
Mixture without_delays(const mocap::Trials& set, const Eigen::MatrixXd& sources);

/// What anechoic demixing is compared with: principal component analysis of the trajectories, the
/// best mixture without delays. Sources are orthogonal, in the order of their energy.
/// @throws ConfigError as sisa() for impossible sets and counts
Mixture principal_components(const mocap::Trials& set, int components);

/// Numbers that describe the mixture, means apart: sources, weights and free delays. With tied
/// delays one per row of a trial and source.
enum class Delays { none, tied, free };
std::int64_t parameter_count(const Mixture& mixture, const mocap::Trials& set, Delays delays);

}  // namespace mimesis::demix
