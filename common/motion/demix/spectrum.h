#pragma once
#include <Eigen/Core>

namespace mimesis::demix {

/// Harmonics 1..F of a period of T samples that a shift can turn: F = ⌊(T−1)/2⌋. The mean and the
/// Nyquist bin are left out (a shifted real Nyquist bin is not real).
inline Eigen::Index harmonic_count(Eigen::Index samples) { return (samples - 1) / 2; }

/// Real spectra of the rows of `x` (N×T), one column each: cosine parts of harmonics 1..H, zeros up
/// to `half`, then sine parts likewise (2·half × N), scaled by √(2/T): inner products of columns
/// are those of the signals. The part at harmonic f is aᶠ + i·bᶠ = Σₜ x(t) e^{−2πift/T}.
Eigen::MatrixXd to_spectrum(const Eigen::MatrixXd& x, Eigen::Index harmonics, Eigen::Index half);
/// Its inverse, rows of T samples. @param spectrum 2·half × N
Eigen::MatrixXd from_spectrum(const Eigen::MatrixXd& spectrum, Eigen::Index samples);

}  // namespace mimesis::demix
