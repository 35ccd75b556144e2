#pragma once
#include <optional>
#include <utility>
#include <vector>

#include "nodes/crowd/rules/gait.h"

namespace mimesis::crowd {

/// The way of period 2π about a lane on which sway keeps a walker [M18 eq. 4.32]: with y = ξ/Δz,
/// ψ' = −m sin(ψ + atan y) + g^ψ, y' = g sin ψ/Δz per radian of gait phase.
struct SwayingWay {
  std::vector<double> psi_rad, y;  ///< over one cycle
  double most = 0.0;               ///< largest √(ψ² + y²)

  /// ψ and y at a phase, between the stored ones.
  std::pair<double, double> at(double phi_rad) const;
};

/// Found by walking until it repeats; empty if it does not, or leads more than 90 degrees aside.
/// @param gain     m_ψ > 0
/// @param ahead_m  Δz > 0
std::optional<SwayingWay> swaying_way(const SpeedFunction& g, const HeadingSway& sway, double gain,
                                      double ahead_m);

}  // namespace mimesis::crowd
