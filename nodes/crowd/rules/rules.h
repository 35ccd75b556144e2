#pragma once
#include <vector>

#include "nodes/crowd/graph/coupling_graph.h"

namespace mimesis::crowd {

/// A coupling graph by its name, or by edges if the topology is `weighted`.
struct GraphSettings {
  Topology topology = Topology::none;
  std::vector<Edge> edges{};
};

/// I: φ̇ᵢ −= m_d sat(Σⱼ Aᵢⱼ (zᵢ − zⱼ − dᵢⱼ)) [M18 eq. 4.28]; with a low-pass, ε̇ = α (L(z − d) − ε)
/// and φ̇ −= m_d sat(ε) [M10].
struct FrequencyRule {
  GraphSettings graph{};
  double gain_rad_m_s = 0.0;    ///< m_d, 0: off
  double saturation_m = 0.0;    ///< of the summed error, 0: none
  double low_pass_rad_s = 0.0;  ///< α, 0: none
};

/// II: ż = (1 + μ) φ̇ g(φ), μᵢ = −m_z Σⱼ Aᵢⱼ (zᵢ − zⱼ − dᵢⱼ) within ±limit [M18 eq. 4.30, M10].
struct LengthRule {
  GraphSettings graph{};
  double gain_1_m = 0.0;  ///< m_z, 0: off
  double limit = 0.5;     ///< of |μ|, (0, 1) [1]
};

/// III: φ̇ᵢ += k Σⱼ Aᵢⱼ (φⱼ − φᵢ) [M18 eq. 4.31], and to a leader φ̇ᵢ += α (φ₀ − φᵢ) [M18 eq. 4.26].
struct PhaseRule {
  GraphSettings graph{};
  double gain_1_s = 0.0;         ///< k, 0: off
  double leader_gain_1_s = 0.0;  ///< α, 0: no leader; else agent 0 of the group leads
};

enum class HeadingKind {
  keep,       ///< goes straight on
  lane,       ///< IV: to the sliding goal on its line [M18 eq. 4.32]
  consensus,  ///< to the mean heading, quorum sensing [M18 eq. 4.33]
  coupled,    ///< to its neighbours, Schöner-Dose [M18 eq. 4.41, 4.45]
  goal        ///< to a place of its own [M18 eq. 3.25]
};

/// IV. With `avoid`, the terms of the navigation dynamics are added [M18 eq. 3.26, 3.27].
struct HeadingRule {
  HeadingKind kind = HeadingKind::keep;
  GraphSettings graph{};  ///< of `coupled`
  double gain =
      1.0;  ///< m_ψ of lane and consensus, per radian of gait [1]; k of coupled and goal [1/s]
  double ahead_m = 2.0;     ///< Δz of the sliding goal
  double low_pass_s = 0.0;  ///< of the consensus variable χ, 0: none
  double spread_rad = 0.0;  ///< σ of the shunting Gaussian of `coupled`, 0: none
  bool avoid = false;
};

/// What agents of one group do about each other. Place of agent i along the path is dᵢ, and
/// dᵢⱼ = dᵢ − dⱼ, so that the distances are consistent.
struct Rules {
  FrequencyRule frequency{};
  LengthRule length{};
  PhaseRule phase{};
  HeadingRule heading{};
};

}  // namespace mimesis::crowd
