#pragma once
#include "common/motion/demix/mixture.h"

namespace mimesis::demix {

/// A mixture says the same if a source is scaled, negated or shifted and its weights and delays are
/// changed accordingly, or if sources change places. Of all these the sources behind the first
/// `given` ones get: unit rms; the crest of the strongest harmonic at t = 0 (of several, the one
/// with the highest s(0)); signs with Σₙ wₙₖ ≥ 0, unless `keep_signs`; the order of the energy they
/// carry, most first. Delays are wrapped to [−π, π]; those without weight are 0.
void fix_gauge(Mixture& mixture, Eigen::Index given, bool keep_signs);

}  // namespace mimesis::demix
