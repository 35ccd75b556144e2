#include "nodes/synthesizer/dynamics/mix.h"

#include "common/math/vector_clones.h"

namespace mimesis::synthesizer {

MIMESIS_VECTOR_CLONES
void mix(const float* series, const float* basis, int basis_count, int stride, float* rows) {
  for (int first = 0; first < stride; first += 16) {
    float sum[16] = {};
    for (int b = 0; b < basis_count; b += 4) {
      const float *c0 = series + b * stride + first, *c1 = c0 + stride, *c2 = c1 + stride,
                  *c3 = c2 + stride;
      const float x0 = basis[b], x1 = basis[b + 1], x2 = basis[b + 2], x3 = basis[b + 3];
      for (int r = 0; r < 16; ++r) {
        sum[r] += (x0 * c0[r] + x1 * c1[r]) + (x2 * c2[r] + x3 * c3[r]);
      }
    }
    for (int r = 0; r < 16; ++r) rows[first + r] = sum[r];
  }
}

}  // namespace mimesis::synthesizer
