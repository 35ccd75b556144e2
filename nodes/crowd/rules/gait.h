#pragma once
#include <array>
#include <span>
#include <utility>

#include "nodes/crowd/rules/lanes.h"

namespace mimesis::crowd {

/// Propagation along the path per radian of gait phase, g(φ) > 0 [m/rad], of period 2π; the speed
/// of a walker is (1 + μ) φ̇ g(φ) [M18 4.4.1, fig. 4.9a]. As a Fourier series
///   g(φ) = mean + Σₖ (cosₖ cos kφ + sinₖ sin kφ),  k = 1 ... 4.
class SpeedFunction {
 public:
  static constexpr int kHarmonics = 4;

  /// @param cosine, sine  amplitudes of cos kφ and sin kφ, k = 1 ...; at most four each [m/rad]
  /// @throws ConfigError for more harmonics, and where g touches or crosses zero: contraction
  ///         needs g > 0
  SpeedFunction(double mean_m_rad, std::span<const double> cosine, std::span<const double> sine);

  /// g(φ) [m/rad]
  double operator()(double phi_rad) const;
  /// G(φ) = ∫₀^φ g [m], for any φ (not wrapped).
  double integral(double phi_rad) const;

  double mean() const { return mean_; }  ///< ⟨g⟩ over a cycle [m/rad]
  double least() const { return least_; }
  double most() const { return most_; }
  double cycle_m() const;  ///< 2π ⟨g⟩: two steps

  std::span<const double> cosine() const { return cosine_; }
  std::span<const double> sine() const { return sine_; }

 private:
  std::pair<double, double> slopes(double phi_rad) const;  // g' and g''

  double mean_, least_, most_;
  std::array<double, kHarmonics> cosine_{}, sine_{};
};

/// Swaying of a walker's heading over the gait cycle, per radian of gait phase: g^ψ(φ) of
/// [M18 eq. 4.32], ψ̇ = φ̇ (m_ψ sin(ψ_goal − ψ) + g^ψ(φ)). Without a mean, which would be a turn:
///   g^ψ(φ) = Σₖ (cosₖ cos kφ + sinₖ sin kφ),  k = 1 ... 4 [1].
/// An input of the heading's dynamics: rates of contraction are those without it.
struct HeadingSway {
  static constexpr int kHarmonics = 4;
  std::array<double, kHarmonics> cosine{}, sine{};

  /// @throws ConfigError for more harmonics, and values that are not finite
  static HeadingSway make(std::span<const double> cosine, std::span<const double> sine);

  bool operator==(const HeadingSway&) const = default;
  bool none() const { return *this == HeadingSway{}; }
  /// g^ψ(φ)
  MIMESIS_PART double operator()(double phi_rad) const {
    double sum = 0.0;
    for_multiples<kHarmonics>(phi_rad, [&](int k, CosSin of) MIMESIS_LAMBDA {
      const auto h = static_cast<std::size_t>(k - 1);
      sum += cosine[h] * of.cos + sine[h] * of.sin;
    });
    return sum;
  }
};

}  // namespace mimesis::crowd
