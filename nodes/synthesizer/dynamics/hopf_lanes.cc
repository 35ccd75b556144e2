#include "nodes/synthesizer/dynamics/hopf_lanes.h"

#include <cmath>

#include "common/math/integrator.h"
#include "common/math/vector_clones.h"

namespace mimesis::synthesizer {
namespace {

struct Plane {
  double x, y;
};
inline Plane operator+(Plane a, Plane b) { return {a.x + b.x, a.y + b.y}; }
inline Plane operator*(double s, Plane a) { return {s * a.x, s * a.y}; }

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

}  // namespace mimesis::synthesizer
