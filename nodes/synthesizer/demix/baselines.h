#pragma once
#include "nodes/synthesizer/demix/mixture.h"
#include "nodes/synthesizer/mocap/trials.h"

/// What an anechoic mixture is held against. All take 1..rank sources and give a Mixture; those
/// without delays have delays 0. @throws ConfigError as sisa()
namespace mimesis::demix {

/// Singular value decomposition of the rows, means removed: the best mixture without delays.
Mixture principal_components(const mocap::Trials& set, int sources);

/// FastICA, symmetric, tanh [Hyvärinen 1999]: independent directions in the space of the principal
/// components, hence with their Q. Ends when no direction turns by more than 1e-10, or after 1000
/// turns.
Mixture independent_components(const mocap::Trials& set, int sources);

/// Harmonics 1..K with a weight and a delay per row: mixtures of free delays where nothing is
/// learned. Up to as many harmonics as the period has.
Mixture sinusoids(const mocap::Trials& set, int sources);

/// Numbers that a mixture of K sources consists of, without means: sources, weights, delays (one a
/// row and source, or one a row of a trial and source if tied; none if `delays` is kNone).
enum class Delays { kNone, kFree, kTied };
Eigen::Index parameter_count(const mocap::Trials& set, int sources, Delays delays);
/// Least number of principal components with at least so many numbers, at most the rank.
int components_of_equal_size(const mocap::Trials& set, Eigen::Index parameters);

}  // namespace mimesis::demix
