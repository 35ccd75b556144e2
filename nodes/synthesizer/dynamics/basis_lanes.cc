#include "nodes/synthesizer/dynamics/basis_lanes.h"

#include <cmath>

#include "common/math/vector_clones.h"
#include "nodes/synthesizer/dynamics/leg_lanes.h"

namespace mimesis::synthesizer {
namespace {

struct Turn {  // cos and sin of an angle, 16 times
  HopfLanes::Lane c, s;
};

inline double larger(double a, double b) { return a > b ? a : b; }

inline void turn_on(Turn& a, const HopfLanes::Lane& cosine, const HopfLanes::Lane& sine) {
  for (int l = 0; l < 16; ++l) {
    const double c = a.c[l] * cosine[l] - a.s[l] * sine[l];
    a.s[l] = a.s[l] * cosine[l] + a.c[l] * sine[l];
    a.c[l] = c;
  }
}

}  // namespace

MIMESIS_VECTOR_CLONES
void basis_values(const HopfLanes::Lane& cosine, const HopfLanes::Lane& sine, int harmonics,
                  bool slow, int basis_count, float* basis) {
  auto put = [&](int b, const HopfLanes::Lane& x) {
    for (int l = 0; l < 16; ++l) basis[l * basis_count + b] = static_cast<float>(x[l]);
  };
  Turn a;
  for (int l = 0; l < 16; ++l) {
    a.c[l] = 1.0;
    a.s[l] = 0.0;
    basis[l * basis_count] = 1.0F;
  }
  for (int h = 1; h <= harmonics; ++h) {
    turn_on(a, cosine, sine);
    put(2 * h - 1, a.c);
    put(2 * h, a.s);
  }
  if (!slow) return;
  // φ/2 in [0, π): its sine is not negative, its cosine has the sign of sin φ. Then again.
  float* to = basis + 2 * harmonics + 1;
  for (int l = 0; l < 16; ++l) {
    const double size = std::sqrt(larger(0.5 + 0.5 * cosine[l], 0.0));
    const double half_c = sine[l] < 0.0 ? -size : size;
    to[l * basis_count] = static_cast<float>(half_c);
    to[l * basis_count + 1] = static_cast<float>(std::sqrt(larger(0.5 - 0.5 * cosine[l], 0.0)));
    to[l * basis_count + 2] = static_cast<float>(std::sqrt(larger(0.5 + 0.5 * half_c, 0.0)));
    to[l * basis_count + 3] = static_cast<float>(std::sqrt(larger(0.5 - 0.5 * half_c, 0.0)));
  }
}

MIMESIS_VECTOR_CLONES
void table_taps(const HopfLanes::Lane& cosine, const HopfLanes::Lane& sine, int samples, int* cell,
                float* taps) {
  const float per_rad = static_cast<float>(samples) * 0.15915494F;
  const int last = samples - 1;
  float tap[4][16];
#pragma GCC ivdep
  for (int l = 0; l < 16; ++l) {
    const float c = static_cast<float>(cosine[l]), s = static_cast<float>(sine[l]);
    const float front = atan2_lane(s < 0.0F ? -s : s, c);
    const float u = (s < 0.0F ? 6.28318531F - front : front) * per_rad;
    const int below = static_cast<int>(u), i = below < last ? below : last;
    const float x = u - static_cast<float>(i);
    const float a = x + 1.0F, b = x - 1.0F, d = x - 2.0F;
    cell[l] = i;
    tap[0][l] = x * b * d * (-1.0F / 6.0F);
    tap[1][l] = a * b * d * 0.5F;
    tap[2][l] = a * x * d * -0.5F;
    tap[3][l] = a * x * b * (1.0F / 6.0F);
  }
  for (int l = 0; l < 16; ++l) {
    for (int k = 0; k < 4; ++k) taps[4 * l + k] = tap[k][l];
  }
}

}  // namespace mimesis::synthesizer
