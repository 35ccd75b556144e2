#pragma once
#include <algorithm>
#include <bit>
#include <cstdint>

namespace mimesis::cognition {

/// eˣ within 2 units in the last place (float) or 4 (double), for |x| <= kExponentLimit (clamped
/// beyond). Only additions, multiplications and bit operations, each rounded once: a loop over it
/// vectorises, and gives the same bits on every machine and at every vector width, which std::exp
/// does not promise.
template <class Real>
struct Exponential;

template <>
struct Exponential<float> {
  using Bits = std::uint32_t;
  static constexpr float kLimit = 80.0F;
  static constexpr float kRound =
      12582912.0F;  // 1.5·2²³: adding it leaves round(x) in the low bits
  static constexpr float kLn2High = 0.693359375F,
                         kLn2Low = -2.12194440e-4F;  // the first has 9 bits
  static constexpr int kMantissa = 23, kTerms = 7;
};

template <>
struct Exponential<double> {
  using Bits = std::uint64_t;
  static constexpr double kLimit = 600.0;
  static constexpr double kRound = 6755399441055744.0;  // 1.5·2⁵²
  static constexpr double kLn2High = 6.93147180369123816490e-01,
                          kLn2Low = 1.90821492927058770002e-10;
  static constexpr int kMantissa = 52, kTerms = 13;
};

namespace detail {
/// 1/n! for Horner's scheme.
template <class Real>
constexpr Real inverse_factorial(int n) {
  double f = 1.0;
  for (int i = 2; i <= n; ++i) f *= i;
  return static_cast<Real>(1.0 / f);
}

template <class Real, int n>
inline Real exponential_series(Real r) {  // Σ_{i>=n} rⁱ⁻ⁿ/i!
  if constexpr (n == Exponential<Real>::kTerms) {
    return inverse_factorial<Real>(n);
  } else {
    return inverse_factorial<Real>(n) + r * exponential_series<Real, n + 1>(r);
  }
}
}  // namespace detail

/// x = k·ln 2 + r with |r| <= ln 2 / 2; eʳ by its series, 2ᵏ through the exponent bits.
template <class Real>
inline Real exponential(Real x) {
  using E = Exponential<Real>;
  x = std::min(std::max(x, -E::kLimit), E::kLimit);
  const Real shifted = x * Real(1.4426950408889634) + E::kRound;
  const Real k = shifted - E::kRound;
  const Real r = (x - k * E::kLn2High) - k * E::kLn2Low;
  const auto power = std::bit_cast<typename E::Bits>(shifted)
                     << E::kMantissa;  // k mod 2ᵉ, in place
  const auto series = std::bit_cast<typename E::Bits>(detail::exponential_series<Real, 0>(r));
  return std::bit_cast<Real>(series + power);
}

}  // namespace mimesis::cognition
