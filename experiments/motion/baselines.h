#pragma once
#include "common/motion/demix/sisa.h"

/// More methods that anechoic demixing is compared with. All are mixtures over the set's rows,
/// means removed; all throw ConfigError as sisa() does for impossible sets and counts.
namespace mimesis::demix {

/// Independent component analysis (FastICA, symmetric, tanh) within the space of the first
/// principal components: the same Q, by construction. Deterministic: starts from the principal
/// components. Sources in the order of the energy they carry.
/// @param turns  at most; it ends when no source turns by more than 1e-9
Mixture independent_components(const mocap::Trials& set, int components, int turns = 400);

/// Harmonics 1..K with free phases in each trajectory: delays without learning [M18 3.3.3].
Mixture sinusoids(const mocap::Trials& set, int harmonics);

/// Principal components that come nearest to `parameters` numbers, at least 1, at most the set's T.
int components_of_equal_size(const mocap::Trials& set, std::int64_t parameters);

}  // namespace mimesis::demix
