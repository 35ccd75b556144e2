#pragma once

namespace mimesis::synthesizer {

/// Andronov-Hopf oscillators of 16 characters, each coupled to an external one [M18 eq. 3.16, 3.18]
struct alignas(64) HopfLanes {
  using Lane = double[16];
  Lane x1 = {}, x2 = {};                ///< state [1]
  Lane omega = {}, alpha = {};          ///< [rad/s], [1/s]
  Lane external1 = {}, external2 = {};  ///< x_ext [1]
};

/// `parts` steps of RK4 over dt_s in all.
void advance(HopfLanes& h, double dt_s, int parts);

/// cos φ and sin φ of the states' phases; a state at the origin, which has none, counts as φ = 0.
void directions(const HopfLanes& h, HopfLanes::Lane& cosine, HopfLanes::Lane& sine);

/// Basis functions of MotionSeries for 16 phases given by cos φ and sin φ, φ in [0, 2π): `basis`
/// receives basis_count floats of one character after the other. Recurrences in double.
void basis_values(const HopfLanes::Lane& cosine, const HopfLanes::Lane& sine, int harmonics,
                  bool slow, int basis_count, float* basis);

/// Where 16 phases are in tables of `samples` rows a period, with a row before phase 0 and two
/// after the last: rows cell..cell+3, and the factors of the cubic through them, four per
/// character.
void table_taps(const HopfLanes::Lane& cosine, const HopfLanes::Lane& sine, int samples, int* cell,
                float* taps);

/// rows[r] += share · Σ_b basis[b] · series[b·stride + r] for all r < stride. basis_count a
/// multiple of 4, stride of 16. Vectorised over the rows, so that characters share a series without
/// gathering.
void add_mix(const float* series, const float* basis, int basis_count, int stride, float share,
             float* rows);

}  // namespace mimesis::synthesizer
