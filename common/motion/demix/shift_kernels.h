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
/// The same for a = b, n×n.
void gram_matrix(const double* a, Eigen::Index n, Eigen::Index length, double* out);

/// A correlation over the whole period: cⱼ = Re Σ_f u(f) e^{ifθⱼ}, u a spectrum, at 4q angles that
/// mirror each other: θ = (i + ½)·2π/4q for i < q, then −θ, π − θ and π + θ of these. So only a
/// quarter of the products is formed. @param table  per harmonic q cosines and q sines of fθ
/// @param quarter  q, a multiple of 8 @param out 4q values
void correlate(const double* table, const double* u, Eigen::Index quarter, Eigen::Index half,
               double* out);

/// What a source gains at each place of a grid, beside others whose weights follow. Single
/// precision: it only proposes.
struct GainTerms {
  const float* const* others;  ///< per other source: its inner product with this one, each place
  Eigen::Index count;          ///< of others, n
  const float* factor;         ///< Cholesky factor L of their Gram matrix, column-major, its
                               ///< diagonal inverted
  Eigen::Index stride;         ///< of its columns, and of those of `weight`
  const float* weight;         ///< L⁻¹ZᵀX, n×p
  const float* data;           ///< grid×p: inner products of this source with the data
  Eigen::Index group, grid;    ///< p; places, a multiple of 16
  float energy, least_room;    ///< of the source; of what the others leave of it, at least
  bool nonnegative;            ///< negative weights gain nothing
};
/// The place where Σᵢ ⟨xᵢ, P⊥s⟩² / ‖P⊥s‖² is largest; `place` unless another one has more, then the
/// first of those. @param scratch 16n + grid values
int best_gain(const GainTerms& terms, int place, float* scratch);

}  // namespace mimesis::demix
