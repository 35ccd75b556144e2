#include "nodes/synthesizer/demix/shift_kernels.h"

#include <cmath>
#include <cstring>

// One body, several instruction sets, chosen when the program starts; eight lanes in all of them
// and nothing contracted, so the results are the same bits. The sanitizers do not survive the
// resolvers.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define MIMESIS_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define MIMESIS_CLONES
#endif

namespace mimesis::demix {
namespace {

using Index = Eigen::Index;
typedef double Lanes8 __attribute__((vector_size(64), aligned(8), may_alias));
typedef double Lanes4 __attribute__((vector_size(32), aligned(8), may_alias));

}  // namespace

MIMESIS_CLONES
void shift_spectrum(const double* source, double phi, Index half, double* z, double* dz) {
  // e^{−ifφ} = c − is, four harmonics at a time, turned on by e^{−4iφ}
  const double c1 = std::cos(phi), s1 = std::sin(phi);
  const double c2 = c1 * c1 - s1 * s1, s2 = 2.0 * c1 * s1;
  const double c3 = c2 * c1 - s2 * s1, s3 = s2 * c1 + c2 * s1;
  const double c4 = c2 * c2 - s2 * s2, s4 = 2.0 * c2 * s2;
  Lanes4 c = {c1, c2, c3, c4}, s = {s1, s2, s3, s4}, f = {1.0, 2.0, 3.0, 4.0};
  for (Index i = 0; i < half; i += 4) {
    const Lanes4 a = *reinterpret_cast<const Lanes4*>(source + i);
    const Lanes4 b = *reinterpret_cast<const Lanes4*>(source + half + i);
    const Lanes4 re = a * c + b * s, im = b * c - a * s;
    *reinterpret_cast<Lanes4*>(z + i) = re;
    *reinterpret_cast<Lanes4*>(z + half + i) = im;
    if (dz != nullptr) {
      *reinterpret_cast<Lanes4*>(dz + i) = f * im;
      *reinterpret_cast<Lanes4*>(dz + half + i) = -f * re;
    }
    const Lanes4 next = c * c4 - s * s4;
    s = s * c4 + c * s4;
    c = next;
    f += 4.0;
  }
}

MIMESIS_CLONES
void inner_products(const double* a, Index na, const double* b, Index nb, Index length,
                    double* out) {
  for (Index j = 0; j < nb; ++j) {
    for (Index i = 0; i < na; ++i) {
      const double *p = a + i * length, *q = b + j * length;
      Lanes8 sum = {};
      for (Index l = 0; l < length; l += 8) {
        sum += *reinterpret_cast<const Lanes8*>(p + l) * *reinterpret_cast<const Lanes8*>(q + l);
      }
      out[i + j * na] =
          ((sum[0] + sum[4]) + (sum[1] + sum[5])) + ((sum[2] + sum[6]) + (sum[3] + sum[7]));
    }
  }
}

MIMESIS_CLONES
void trigonometric_sum(const double* table, const double* u, Index count, Index length,
                       double* out) {
  for (Index j = 0; j < count; j += 8) {
    Lanes8 sum = {};
    for (Index l = 0; l < length; ++l) {
      sum += u[l] * *reinterpret_cast<const Lanes8*>(table + l * count + j);
    }
    *reinterpret_cast<Lanes8*>(out + j) = sum;
  }
}

}  // namespace mimesis::demix
