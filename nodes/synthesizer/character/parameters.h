#pragma once
#include <span>

#include "common/motion/model/motion_model.h"

namespace mimesis::synthesizer {

/// Motion of a character at one instant: the mixture's parameters for R rows and K sources, and the
/// pace. They come from a `Pattern`; between patterns they are blended.
struct MotionParameters {
  Eigen::VectorXd mean_rad;      ///< m, R
  Eigen::MatrixXd weight_rad;    ///< w, R×K
  Eigen::MatrixXd delay_rad;     ///< φ, R×K, of either sign and not wrapped: blended linearly
  double frequency_rad_s = 0.0;  ///< ω₀ of the leading oscillator: 2π / duration of a cycle
};

/// @throws ConfigError if the sizes do not fit each other, a number is not finite or the duration
/// is not positive.
MotionParameters parameters_of(const motion::Pattern& pattern);

/// Σ αₚ · parts[p] of all parameters [M18 eq. 3.19-3.22 for two]; Σ αₚ = 1, each of any sign. `out`
/// may not be one of the parts. Does not allocate if `out` has the size.
void blend(std::span<const MotionParameters> parts, std::span<const double> alpha,
           MotionParameters& out);

/// α of [M18 eq. 3.23]: from 0 to 1 while φ goes from −βπ to βπ, ½ at the transition φ = 0.
/// φ in [−2π, 2π): negative in the previous action, from 0 in the next one.
double transition_weight(double phase_rad, double beta);

/// The parameters at phase φ of a transition. Means and weights of periodic sources go linearly
/// with α. The first `fixed` sources are ramps, s₀ = cos(φ/2) over each action, that jump from −1
/// to +1 at φ = 0; theirs are [M18 after eq. 3.23]
///   w(φ) = sign(φ)[(α − 1) w_prev + α w_post]   (sign(0) = +1),
/// which makes w·s₀ = cos(φ/2)[(α − 1) w_prev + α w_post] without a jump in any derivative at
/// φ = 0. (What the text calls the intermediate value W_trans = (m_prev + m_post)/2 +
/// (w_post − w_prev)/2 is not that of a weight but, with the means, that of the joint angle; the
/// weights arrive at ∓(w_post − w_prev)/2.) Frequencies go with α as in eq. 3.22; delays too, which
/// are the same in all actions of the dissertation.
/// `out` may not be one of the two. Does not allocate if `out` has the size.
void transition(const MotionParameters& previous, const MotionParameters& next, int fixed,
                double phase_rad, double beta, MotionParameters& out);

}  // namespace mimesis::synthesizer
