#pragma once
#include "nodes/synthesizer/dynamics/hopf_lanes.h"

namespace mimesis::synthesizer {

/// Basis functions of MotionSeries for 16 phases given by cos φ and sin φ, φ in [0, 2π): `basis`
/// receives basis_count floats of one character after the other. Recurrences in double.
void basis_values(const HopfLanes::Lane& cosine, const HopfLanes::Lane& sine, int harmonics,
                  bool slow, int basis_count, float* basis);

/// Where 16 phases are in tables of `samples` rows a period, with a row before phase 0 and two
/// after the last: rows cell..cell+3, and the factors of the cubic through them, four per
/// character.
void table_taps(const HopfLanes::Lane& cosine, const HopfLanes::Lane& sine, int samples, int* cell,
                float* taps);

}  // namespace mimesis::synthesizer
