#pragma once
#include "nodes/synthesizer/dynamics/hopf_lanes.h"

namespace mimesis::synthesizer {

/// Basis functions of MotionSeries for 16 phases given by cos φ and sin φ, φ in [0, 2π): `basis`
/// receives basis_count floats of one character after the other. Recurrences in double.
void basis_values(const HopfLanes::Lane& cosine, const HopfLanes::Lane& sine, int harmonics,
                  bool slow, int basis_count, float* basis);

}  // namespace mimesis::synthesizer
