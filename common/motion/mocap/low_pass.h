#pragma once
#include <Eigen/Core>

namespace mimesis::mocap {

/// Zero-phase low-pass of every row: a Butterworth filter of `order` (even), run forwards and then
/// backwards. By the bilinear transform with the cutoff prewarped, a sine of frequency f keeps its
/// phase and the share 1 / (1 + (tan(πf/rate) / tan(πf_c/rate))^(2·order)) of its amplitude: one
/// half at the cutoff. At both ends the row is continued by three periods of the cutoff, or its
/// own length if that is shorter, reflected in its end point, so that a ramp stays a ramp; the
/// filter starts in the steady state of its first value.
/// @param rows       R×F, finite, F ≥ 2
/// @param cutoff_hz  in (0, rate/2)
/// @throws ConfigError if rate, cutoff or order do not fit or a value is not finite
Eigen::MatrixXd low_pass(const Eigen::Ref<const Eigen::MatrixXd>& rows, double rate_hz,
                         double cutoff_hz, int order = 2);

}  // namespace mimesis::mocap
