#pragma once
#include <bit>
#include <cstdint>

// For functions that hold or enter such loops: they become part of their caller, and so are
// compiled for the caller's instruction set.
#define MIMESIS_PART __attribute__((always_inline)) inline
#define MIMESIS_LAMBDA __attribute__((always_inline))

namespace mimesis::crowd {

// Functions of one number each, made for loops over agents: no branch, nothing called but sqrt,
// every operation rounded as IEEE says. Loops around them are vectorised by the compiler and give
// the same bits on every instruction set, which sines and exponentials of the C library do not.

struct CosSin {
  double cos, sin;
};

/// Nearest integer of |x| < 2⁵¹.
inline double nearest_lane(double x) {
  constexpr double kMagic = 6755399441055744.0;  // 1.5·2⁵²
  return (x + kMagic) - kMagic;
}

/// For |angle| < 1e6 rad, to 2e-16 and the rounding of the angle itself. Quarter turns are taken
/// off in three parts [Cody, Waite]; in [-π/4, π/4] the polynomials of Cephes.
MIMESIS_PART CosSin cos_sin_lane(double angle_rad) {
  const double quarters = nearest_lane(angle_rad * 0.63661977236758134308);
  double r = angle_rad - quarters * 1.57079625129699707031;
  r -= quarters * 7.54978941586159635335e-8;
  r -= quarters * 5.39030252995776476554e-15;
  const double u = r * r;
  double s = 1.58962301576546568060e-10;
  s = s * u - 2.50507477628578072866e-8;
  s = s * u + 2.75573136213857245213e-6;
  s = s * u - 1.98412698295895385996e-4;
  s = s * u + 8.33333333332211858878e-3;
  s = s * u - 1.66666666666666307295e-1;
  s = r + r * u * s;
  double c = -1.13585365213876817300e-11;
  c = c * u + 2.08757008419747316778e-9;
  c = c * u - 2.75573141792967388112e-7;
  c = c * u + 2.48015872888517045348e-5;
  c = c * u - 1.38888888888730564116e-3;
  c = c * u + 4.16666666666665929218e-2;
  c = 1.0 - 0.5 * u + u * u * c;
  // quarters mod 4, as 0, 1, 2, 3 (−1)
  const double quadrant = quarters - 4.0 * nearest_lane(quarters * 0.25);
  const bool odd = quadrant == 1.0 || quadrant == -1.0;
  const double a = odd ? s : c, b = odd ? c : s;
  const bool half = quadrant == 2.0 || quadrant == -2.0;
  const double sign_c = half || quadrant == 1.0 ? -1.0 : 1.0;
  const double sign_s = half || quadrant == -1.0 ? -1.0 : 1.0;
  return {sign_c * a, sign_s * b};
}

/// Calls f(k, {cos kφ, sin kφ}) for k = 1 ... n, by the recurrence of Chebyshev. Returns cos φ, sin
/// φ.
template <int n, class F>
MIMESIS_PART CosSin for_multiples(double angle_rad, F&& f) {
  const CosSin one = cos_sin_lane(angle_rad);
  const double twice = 2.0 * one.cos;
  CosSin before{1.0, 0.0}, now = one;
  for (int k = 1; k <= n; ++k) {
    f(k, now);
    const CosSin next{twice * now.cos - before.cos, twice * now.sin - before.sin};
    before = now;
    now = next;
  }
  return one;
}

/// An angle in [-π, π] that differs by whole turns.
inline double wrap_lane(double angle_rad) {
  const double turns = nearest_lane(angle_rad * 0.15915494309189533577);
  return (angle_rad - turns * 6.28318500518798828125) - turns * 3.01991598195675286766e-7;
}

inline double clamp_lane(double x, double limit) {
  const double below = x < limit ? x : limit;
  return below > -limit ? below : -limit;
}

/// e^x of x in [-700, 0], to 3e-16 of it.
inline double exp_lane(double x) {
  const double n = nearest_lane(x * 1.44269504088896340736);
  const double r = (x - n * 6.93145751953125e-1) - n * 1.42860682030941723212e-6;
  double p = 1.0 / 6227020800.0;  // 1/13!
  p = p * r + 1.0 / 479001600.0;
  p = p * r + 1.0 / 39916800.0;
  p = p * r + 1.0 / 3628800.0;
  p = p * r + 1.0 / 362880.0;
  p = p * r + 1.0 / 40320.0;
  p = p * r + 1.0 / 5040.0;
  p = p * r + 1.0 / 720.0;
  p = p * r + 1.0 / 120.0;
  p = p * r + 1.0 / 24.0;
  p = p * r + 1.0 / 6.0;
  p = p * r + 0.5;
  p = p * r + 1.0;
  p = p * r + 1.0;
  constexpr double kMagic = 6755399441055744.0;  // its low bits take n
  const auto bits = (std::bit_cast<std::uint64_t>(n + kMagic) + 1023U) << 52U;
  return p * std::bit_cast<double>(bits);
}

/// limit · tanh(x/limit); limit > 0. To 2e-16 of the limit.
inline double tanh_lane(double x, double limit) {
  const double size = x < 0.0 ? -x : x;
  const double twice = 2.0 * size / limit;
  const double e = exp_lane(-(twice < 60.0 ? twice : 60.0));
  const double s = limit * (1.0 - e) / (1.0 + e);
  return x < 0.0 ? -s : s;
}

}  // namespace mimesis::crowd
