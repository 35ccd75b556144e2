#include "common/qp/kernels.h"

#include <cmath>
#include <cstring>

#include "common/math/vector_clones.h"

namespace mimesis::qp {
namespace {

// Four doubles anywhere in memory; every instruction set adds them in the same order.
using Lanes4 [[gnu::vector_size(32), gnu::aligned(8), gnu::may_alias]] = double;

constexpr double kRounding = 1e-14;  // a pivot below this share of its diagonal element is zero

#define MIMESIS_QP_AT(p) (*reinterpret_cast<Lanes4*>(p))
#define MIMESIS_QP_OF(p) (*reinterpret_cast<const Lanes4*>(p))
#define MIMESIS_QP_SUM(v) (((v)[0] + (v)[1]) + ((v)[2] + (v)[3]))

}  // namespace

MIMESIS_VECTOR_CLONES
void dots(const double* columns, std::size_t stride, std::size_t count, const double* v,
          double* out) {
  std::size_t j = 0;
  for (; j + 4 <= count; j += 4) {
    const double *a = columns + j * stride, *b = a + stride, *c = b + stride, *d = c + stride;
    Lanes4 sa = {}, sb = {}, sc = {}, sd = {};
    for (std::size_t i = 0; i < stride; i += 4) {
      const Lanes4 x = MIMESIS_QP_OF(v + i);
      sa += x * MIMESIS_QP_OF(a + i);
      sb += x * MIMESIS_QP_OF(b + i);
      sc += x * MIMESIS_QP_OF(c + i);
      sd += x * MIMESIS_QP_OF(d + i);
    }
    out[j] = MIMESIS_QP_SUM(sa);
    out[j + 1] = MIMESIS_QP_SUM(sb);
    out[j + 2] = MIMESIS_QP_SUM(sc);
    out[j + 3] = MIMESIS_QP_SUM(sd);
  }
  for (; j < count; ++j) {
    const double* a = columns + j * stride;
    Lanes4 sum = {};
    for (std::size_t i = 0; i < stride; i += 4) sum += MIMESIS_QP_OF(v + i) * MIMESIS_QP_OF(a + i);
    out[j] = MIMESIS_QP_SUM(sum);
  }
}

MIMESIS_VECTOR_CLONES
void add_columns(const double* columns, std::size_t stride, std::size_t count,
                 const double* factors, double* out) {
  std::size_t j = 0;
  for (; j + 4 <= count; j += 4) {
    const double *a = columns + j * stride, *b = a + stride, *c = b + stride, *d = c + stride;
    const double fa = factors[j], fb = factors[j + 1], fc = factors[j + 2], fd = factors[j + 3];
    for (std::size_t i = 0; i < stride; i += 4) {
      MIMESIS_QP_AT(out + i) += (fa * MIMESIS_QP_OF(a + i) + fb * MIMESIS_QP_OF(b + i)) +
                                (fc * MIMESIS_QP_OF(c + i) + fd * MIMESIS_QP_OF(d + i));
    }
  }
  for (; j < count; ++j) {
    const double* a = columns + j * stride;
    for (std::size_t i = 0; i < stride; i += 4) {
      MIMESIS_QP_AT(out + i) += factors[j] * MIMESIS_QP_OF(a + i);
    }
  }
}

MIMESIS_VECTOR_CLONES
void subtract_outer(double* columns, std::size_t stride, std::size_t count, const double* factors,
                    const double* v) {
  for (std::size_t j = 0; j < count; ++j) {
    double* a = columns + j * stride;
    for (std::size_t i = 0; i < stride; i += 4) {
      MIMESIS_QP_AT(a + i) -= factors[j] * MIMESIS_QP_OF(v + i);
    }
  }
}

MIMESIS_VECTOR_CLONES
void rotate(double* a, double* b, std::size_t stride, double c, double s) {
  for (std::size_t i = 0; i < stride; i += 4) {
    const Lanes4 x = MIMESIS_QP_AT(a + i), y = MIMESIS_QP_AT(b + i);
    MIMESIS_QP_AT(a + i) = c * x + s * y;
    MIMESIS_QP_AT(b + i) = c * y - s * x;
  }
}

MIMESIS_VECTOR_CLONES
bool invert_cholesky(double* lower, std::size_t stride, std::size_t n, double* inverse) {
  for (std::size_t j = 0; j < n; ++j) inverse[j] = kRounding * lower[j * stride + j];
  for (std::size_t j = 0; j < n; ++j) {
    double* column = lower + j * stride;
    const std::size_t from = j / 4 * 4;  // elements above the diagonal are not read
    if (!(column[j] > inverse[j]) || !std::isfinite(column[j])) return false;
    const double scale = 1.0 / std::sqrt(column[j]);
    for (std::size_t i = from; i < stride; i += 4) MIMESIS_QP_AT(column + i) *= scale;
    for (std::size_t k = j + 1; k < n; ++k) {
      double* a = lower + k * stride;
      const double factor = column[k];
      for (std::size_t i = k / 4 * 4; i < stride; i += 4) {
        MIMESIS_QP_AT(a + i) -= factor * MIMESIS_QP_OF(column + i);
      }
    }
  }
  // Row j of L M = I, M = L⁻¹: Mⱼ = (eⱼ − Σ_{k<j} Lⱼₖ Mₖ) / Lⱼⱼ. Rows of M are columns of L⁻ᵀ.
  std::memset(inverse, 0, sizeof(double) * stride * n);
  for (std::size_t j = 0; j < n; ++j) {
    double* row = inverse + j * stride;
    for (std::size_t k = 0; k < j; ++k) {
      const double factor = lower[k * stride + j];
      for (std::size_t i = 0; i <= k; i += 4) {
        MIMESIS_QP_AT(row + i) -= factor * MIMESIS_QP_OF(inverse + k * stride + i);
      }
    }
    row[j] += 1.0;
    const double scale = 1.0 / lower[j * stride + j];
    for (std::size_t i = 0; i <= j; i += 4) MIMESIS_QP_AT(row + i) *= scale;
  }
  return true;
}

}  // namespace mimesis::qp
