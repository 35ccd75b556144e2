#pragma once
#include <span>

#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer {

/// What a character plays at one instant: the mixture's parameters for R rows and K sources, and
/// the pace. A `Pattern` is where they come from; between patterns they are blended.
struct MotionParameters {
  Eigen::VectorXd mean_rad;      ///< m, R
  Eigen::MatrixXd weight_rad;    ///< w, R×K
  Eigen::MatrixXd delay_rad;     ///< φ, R×K, of either sign and not wrapped: blended linearly
  double frequency_rad_s = 0.0;  ///< ω₀ of the leading oscillator: 2π / duration of a cycle
};

/// @throws ConfigError if the sizes do not fit each other, a number is not finite or the duration
/// is not positive.
MotionParameters parameters_of(const Pattern& pattern);

/// Σ αₚ · parts[p] of all parameters [M18 eq. 3.19-3.22 for two]; Σ αₚ = 1, each of any sign. `out`
/// may not be one of the parts. Does not allocate if `out` has the size.
void blend(std::span<const MotionParameters> parts, std::span<const double> alpha,
           MotionParameters& out);

}  // namespace mimesis::synthesizer
