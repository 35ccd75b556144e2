#pragma once

namespace mimesis::crowd {

/// Networks of Andronov-Hopf oscillators in Cartesian coordinates, coupled with k on a graph of
/// connectivity λ⁺ [M18 4.3]. Rates are per unit of time of eq. 4.14.
struct HopfRates {
  bool sufficient = false;  ///< kλ⁺ > 1: contracts from every start [M18 eq. 4.25]; not necessary
  double bound_1_s = 0.0;   ///< kλ⁺ − 1, what contraction guarantees
  double near_1_s = 0.0;    ///< kλ⁺, near synchrony on the limit cycle
};

inline HopfRates hopf_rates(double k_1_s, double connectivity) {
  const double rate = k_1_s * connectivity;
  return {rate > 1.0, rate - 1.0, rate};
}

/// Followers of a leader, α to it [M18 eq. 4.26]. The Laplacian's eigenvalue 0 leaves α alone for
/// the way to the leader: λ_min(kL + αI) = α, not kN + α.
struct LeaderRates {
  HopfRates mutual;    ///< of followers with each other: kλ⁺ + α
  HopfRates tracking;  ///< of all to the leader: α
};

inline LeaderRates leader_rates(double k_1_s, double connectivity, double alpha_1_s) {
  return {hopf_rates(1.0, k_1_s * connectivity + alpha_1_s), hopf_rates(1.0, alpha_1_s)};
}

}  // namespace mimesis::crowd
