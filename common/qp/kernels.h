#pragma once
#include <cstddef>

namespace mimesis::qp {

/// Columns of doubles for vector registers: every one begins `stride` after the one before, a
/// multiple of four, and is filled up with zeros.
inline std::size_t padded(std::size_t n) { return (n + 3) / 4 * 4; }

/// out_j = columns_j · v for j < count. O(count · stride). `v` is padded as well.
void dots(const double* columns, std::size_t stride, std::size_t count, const double* v,
          double* out);
/// out += Σⱼ factor_j · columns_j. O(count · stride).
void add_columns(const double* columns, std::size_t stride, std::size_t count,
                 const double* factors, double* out);
/// columns_j −= factor_j · v. O(count · stride).
void subtract_outer(double* columns, std::size_t stride, std::size_t count, const double* factors,
                    const double* v);
/// Turns two columns: a ← c a + s b, b ← c b − s a.
void rotate(double* a, double* b, std::size_t stride, double c, double s);

/// H = L Lᵀ, then L⁻ᵀ: an upper triangle of columns `stride` apart. `lower` is H's lower triangle
/// on entry, n columns `stride` apart, and is spoilt. @return false if a pivot is not positive
/// (or nothing but rounding).
bool invert_cholesky(double* lower, std::size_t stride, std::size_t n, double* inverse);

}  // namespace mimesis::qp
