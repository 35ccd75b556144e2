#include "nodes/synthesizer/dynamics/mixture_lanes.h"

#include <cmath>

#include "common/math/integrator.h"
#include "common/math/vector_clones.h"
#include "nodes/synthesizer/dynamics/lanes.h"

namespace mimesis::synthesizer {

namespace {

struct Plane {
  double x, y;
};
inline Plane operator+(Plane a, Plane b) { return {a.x + b.x, a.y + b.y}; }
inline Plane operator*(double s, Plane a) { return {s * a.x, s * a.y}; }

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
void advance(HopfLanes& h, double dt_s, int parts) {
  const double part = dt_s / parts;
  for (int i = 0; i < parts; ++i) {
#pragma GCC ivdep
    for (int l = 0; l < 16; ++l) {
      const double omega = h.omega[l], alpha = h.alpha[l];
      const Plane external{h.external1[l], h.external2[l]};
      auto rate = [&](double, Plane x) {
        const double grow = 1.0 - (x.x * x.x + x.y * x.y);
        return Plane{grow * x.x - omega * x.y + alpha * (external.x - x.x),
                     grow * x.y + omega * x.x + alpha * (external.y - x.y)};
      };
      const Plane x = math::rk4_step(rate, 0.0, Plane{h.x1[l], h.x2[l]}, part);
      h.x1[l] = x.x;
      h.x2[l] = x.y;
    }
  }
}

MIMESIS_VECTOR_CLONES
void directions(const HopfLanes& h, HopfLanes::Lane& cosine, HopfLanes::Lane& sine) {
#pragma GCC ivdep
  for (int l = 0; l < 16; ++l) {
    const double r = std::sqrt(h.x1[l] * h.x1[l] + h.x2[l] * h.x2[l]);
    cosine[l] = r > 1e-9 ? h.x1[l] / r : 1.0;
    sine[l] = r > 1e-9 ? h.x2[l] / r : 0.0;
  }
}

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
