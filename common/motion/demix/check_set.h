#pragma once
#include "common/motion/demix/sisa.h"

/// What the demixing methods ask of their input. All throw ConfigError in one line.
namespace mimesis::demix {

/// Trials and rows are there, the sizes fit, at least 4 samples, all finite, not all constant.
void check_set(const mocap::Trials& set);
/// `sources` (named `what` in the message) have the set's period and are finite and not constant.
void check_given(const Eigen::MatrixXd& sources, const char* what, Eigen::Index samples);
/// One finite delay for each row of a trial and known source.
void check_known(const mocap::Trials& set, const KnownSources& known);
/// 1 ≤ K ≤ rank of the set, and at least `given`.
void check_count(const mocap::Trials& set, int sources, int given);

/// Independent rows of the set, means and Nyquist bin removed, as far as rounding lets one see.
Eigen::Index rank(const mocap::Trials& set);

}  // namespace mimesis::demix
