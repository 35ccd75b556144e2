#pragma once
#include <cstdint>

#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer::testing {

/// A model without recorded data: all 51 body rows of the standard body, T = 100, tied delays,
/// sources with random harmonics 1..5 that fall as 1/h², random weights of some degrees. Its
/// figures wave their limbs; they do not walk. Same seed, same bits.
/// @param fixed  0..3: the first sources are demix::non_periodic's, scaled to unit rms
motion::MotionModel random_model(std::uint64_t seed, int sources = 4, int patterns = 3,
                                 int fixed = 0);

/// How a synthetic walker walks.
struct WalkSettings {
  double speed_m_s = 1.0, duration_s = 1.0;
  double turn_rad_s = 0.0;  ///< to the left
  /// The left foot slides forward by this during its stance, the right one back: what root motion
  /// from one foot cannot repair. 0: feet stand while either is on the ground.
  double slide_m = 0.0;
  int harmonics = 24;
};

/// A walk constructed from its feet: flat feet that rest on the ground for 60 % of the cycle each
/// (phase 0: left foot lands) and swing 10 cm high; legs by inverse kinematics, swinging arms. The
/// rows' Fourier series become the mixture: sources √2 cos hφ, one weight and delay per row.
motion::MotionModel walking_model(const WalkSettings& settings = {});

}  // namespace mimesis::synthesizer::testing
