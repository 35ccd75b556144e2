#pragma once
#include <Eigen/Core>

/// The inner loops of demixing, on real spectra (spectrum.h) whose `half` is a multiple of 4.
/// Nothing here allocates.
namespace mimesis::demix {

/// z = the spectrum of s(t − τ) for the delay φ = 2πτ/T [rad], and dz = ∂z/∂φ (none if null).
void shift_spectrum(const double* source, double phi, Eigen::Index half, double* z, double* dz);

/// out(i, j) = aᵢ·bⱼ, column-major na×nb, for columns of `length` (a multiple of 8).
void inner_products(const double* a, Eigen::Index na, const double* b, Eigen::Index nb,
                    Eigen::Index length, double* out);

/// out = table·u: `count` values of a trigonometric sum. @param table count×length, column-major,
/// count a multiple of 8.
void trigonometric_sum(const double* table, const double* u, Eigen::Index count,
                       Eigen::Index length, double* out);

}  // namespace mimesis::demix
