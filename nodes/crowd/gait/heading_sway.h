#pragma once
#include <array>
#include <span>

namespace mimesis::crowd {

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
  bool none() const;
  double operator()(double phi_rad) const;
  /// How far ψ sways to one side of its goal at most, near a goal that stays:
  /// Σₖ |aₖ|/√(m² + k²) with aₖ the amplitude of the k-th harmonic [rad].
  /// @param gain  m_ψ >= 0
  double amplitude_rad(double gain) const;
};

}  // namespace mimesis::crowd
