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

}  // namespace mimesis::synthesizer
