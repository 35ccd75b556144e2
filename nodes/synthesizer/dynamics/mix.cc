#include "nodes/synthesizer/dynamics/mix.h"

#include "common/math/vector_clones.h"

namespace mimesis::synthesizer {

MIMESIS_VECTOR_CLONES
void add_mix(const float* series, const float* basis, int basis_count, int stride, float share,
             float* rows) {
  for (int b = 0; b < basis_count; b += 4) {
    const float *c0 = series + b * stride, *c1 = c0 + stride, *c2 = c1 + stride, *c3 = c2 + stride;
    const float x0 = share * basis[b], x1 = share * basis[b + 1], x2 = share * basis[b + 2],
                x3 = share * basis[b + 3];
#pragma GCC ivdep
    for (int r = 0; r < stride; ++r) {
      rows[r] += (x0 * c0[r] + x1 * c1[r]) + (x2 * c2[r] + x3 * c3[r]);
    }
  }
}

}  // namespace mimesis::synthesizer
