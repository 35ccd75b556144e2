#pragma once
#include <cstdint>

#include "common/motion/demix/mixture.h"
#include "common/motion/mocap/trials.h"

/// What anechoic demixing is compared with.
namespace mimesis::demix {

/// Principal component analysis of the trajectories: the best mixture without delays. Sources are
/// orthogonal, in the order of their energy.
/// @throws ConfigError as sisa() for impossible sets and counts
Mixture principal_components(const mocap::Trials& set, int components);

/// Numbers that describe the mixture, means apart: sources, weights and free delays. With tied
/// delays one per row of a trial and source.
enum class Delays { none, tied, free };
std::int64_t parameter_count(const Mixture& mixture, const mocap::Trials& set, Delays delays);

}  // namespace mimesis::demix
