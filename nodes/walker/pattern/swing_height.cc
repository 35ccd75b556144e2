#include "nodes/walker/pattern/swing_height.h"

#include <algorithm>

namespace mimesis::walker {
namespace {

constexpr double kRise = 0.42, kGlide = 0.2;  ///< shares of the time; the fall is between
constexpr double kGlideHeight = 0.12;         ///< where the glide begins
constexpr SwingHeight kTop{1.0, 0.0, -24.0};

/// After `t` of the polynomial of fifth degree from one state to another in `D` > 0.
SwingHeight between(const SwingHeight& from, const SwingHeight& to, double D, double t) {
  const double u = t / D, v = D * from.dz, a = D * D * from.ddz;
  const double p = to.z - from.z - v - 0.5 * a, q = D * to.dz - v - a, r = D * D * to.ddz - a;
  const double c3 = 10.0 * p - 4.0 * q + 0.5 * r, c4 = -15.0 * p + 7.0 * q - r,
               c5 = 6.0 * p - 3.0 * q + 0.5 * r;
  return {from.z + u * (v + u * (0.5 * a + u * (c3 + u * (c4 + u * c5)))),
          (v + u * (a + u * (3.0 * c3 + u * (4.0 * c4 + u * 5.0 * c5)))) / D,
          (a + u * (6.0 * c3 + u * (12.0 * c4 + u * 20.0 * c5))) / (D * D)};
}

/// `left`: share of the glide that is to come.
SwingHeight glide(double left) {
  return {kGlideHeight * left * left, -2.0 * kGlideHeight / kGlide * left,
          2.0 * kGlideHeight / (kGlide * kGlide)};
}

}  // namespace

SwingHeight swing_height(double u) {
  if (u < kRise) return between({}, kTop, kRise, std::max(0.0, u));
  if (u < 1.0 - kGlide) return between(kTop, glide(1.0), 1.0 - kGlide - kRise, u - kRise);
  if (u < 1.0) return glide((1.0 - u) / kGlide);
  return {};
}

}  // namespace mimesis::walker
