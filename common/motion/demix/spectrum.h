#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace mimesis::demix {

/// Harmonics 1..F of a period of T samples that a shift can turn: F = ⌊(T−1)/2⌋. The mean and the
/// Nyquist bin are left out (a shifted real Nyquist bin is not real).
inline Eigen::Index harmonic_count(Eigen::Index samples) { return (samples - 1) / 2; }

/// Real spectra of the rows of `x` (N×T), one column each: cosine parts of harmonics 1..H, zeros up
/// to `half`, then sine parts in the same order (2·half × N), scaled by √(2/T): inner products of
/// columns are those of the signals. The part at harmonic f is aᶠ + i·bᶠ = Σₜ x(t) e^{−2πift/T}.
Eigen::MatrixXd to_spectrum(const Eigen::MatrixXd& x, Eigen::Index harmonics, Eigen::Index half);
/// Its inverse, rows of T samples. @param spectrum 2·half × N
Eigen::MatrixXd from_spectrum(const Eigen::MatrixXd& spectrum, Eigen::Index samples);

// Inner loops of demixing, on real spectra whose `half` is a multiple of 4. Nothing here allocates.

/// z = the spectrum of s(t − τ) for the delay φ = 2πτ/T [rad], and dz = ∂z/∂φ (none if null).
void shift_spectrum(const double* source, double phi, Eigen::Index half, double* z, double* dz);

/// out(i, j) = aᵢ·bⱼ, column-major na×nb, for columns of `length` (a multiple of 8).
void inner_products(const double* a, Eigen::Index na, const double* b, Eigen::Index nb,
                    Eigen::Index length, double* out);
/// Gram matrix of one set of rows (a = b), n×n.
void gram_matrix(const double* a, Eigen::Index n, Eigen::Index length, double* out);

/// A correlation over the whole period: cⱼ = Re Σ_f u(f) e^{ifθⱼ}, u a spectrum, at 4q angles that
/// mirror each other: θ = (i + ½)·2π/4q for i < q, then −θ, π − θ and π + θ of these. So only a
/// quarter of the products is formed. @param table  per harmonic q cosines and q sines of fθ
/// @param quarter  q, a multiple of 8 @param out 4q values
void correlate(const double* table, const double* u, Eigen::Index quarter, Eigen::Index half,
               double* out);

/// Gain of a source at each place of a grid, beside other sources whose weights follow. Single
/// precision, because it only proposes.
struct GainTerms {
  const float* const* others;  ///< per other source: its inner product with this one, each place
  Eigen::Index count;          ///< number of other sources, n
  const float* factor;         ///< Cholesky factor L of their Gram matrix, column-major, its
                               ///< diagonal inverted
  Eigen::Index stride;         ///< stride of its columns, and of the columns of `weight`
  const float* weight;         ///< L⁻¹ZᵀX, n×p
  const float* data;           ///< grid×p: inner products of this source with the data
  Eigen::Index group, grid;    ///< p; places, a multiple of 16
  float energy, least_room;    ///< energy of the source; least energy that the others leave of it
  bool nonnegative;            ///< negative weights gain nothing
};
/// The place where Σᵢ ⟨xᵢ, P⊥s⟩² / ‖P⊥s‖² is largest; `place` unless another one has more, then the
/// first of those. @param scratch 16n + grid values
int best_gain(const GainTerms& terms, int place, float* scratch);

// Factors of a few rows, once per trajectory and step: a call of Eigen's solvers costs more than
// the work. Loops in the order of their indices: the same bits everywhere.

/// A + ridge·I → its Cholesky factor L in place of the lower triangle of the leading n×n, the
/// diagonal inverted. Pivots below `ridge` count as `ridge`.
template <class Matrix>
void small_cholesky(Matrix& a, Eigen::Index n, typename Matrix::Scalar ridge) {
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = j; i < n; ++i) {
      auto sum = a(i, j);
      for (Eigen::Index q = 0; q < j; ++q) sum -= a(i, q) * a(j, q);
      if (i == j) {
        a(j, j) = 1 / std::sqrt(std::max(sum + ridge, ridge));
      } else {
        a(i, j) = sum * a(j, j);
      }
    }
  }
}

/// x ← L⁻¹x for such a factor.
template <class Matrix>
void small_forward(const Matrix& factor, Eigen::Index n, typename Matrix::Scalar* x) {
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index q = 0; q < i; ++q) x[i] -= factor(i, q) * x[q];
    x[i] *= factor(i, i);
  }
}

/// x ← L⁻ᵀL⁻¹x: solves A x = b.
template <class Matrix>
void small_solve(const Matrix& factor, Eigen::Index n, typename Matrix::Scalar* x) {
  small_forward(factor, n, x);
  for (Eigen::Index i = n - 1; i >= 0; --i) {
    for (Eigen::Index q = i + 1; q < n; ++q) x[i] -= factor(q, i) * x[q];
    x[i] *= factor(i, i);
  }
}

}  // namespace mimesis::demix
