#pragma once
#include <span>

#include "common/math/circle.h"
#include "nodes/crowd/graph/coupling_graph.h"
#include "nodes/crowd/rules/circular_sum.h"

namespace mimesis::crowd {

// Rule III: φ̇ᵢ += k Σⱼ Aᵢⱼ (φⱼ − φᵢ) [M18 eq. 4.19, 4.31], to a leader also α (φ₀ − φᵢ) [eq. 4.26].
//
// "Modulo 2π" leaves open how differences are summed, and decides whether synchrony is reached from
// every start. Sums of wrapped differences are caught in twisted states on every graph with a
// cycle, and so are sums of sines. Hence
// - all-to-all: all are pulled to one direction, arg(k Σⱼ e^{iφⱼ} + α e^{iφ₀}), at k N + α; near
//   synchrony that is the sum. O(N), of any phases.
// - other graphs: plain differences of lifted phases, that is of real numbers that are wrapped no
//   more once `lift_phases` has chosen their turns. The dynamics is linear, as the theory has it:
//   it contracts at kλ⁺ (to the leader at least at α) from every start.
//
// With a leader the nodes of the graph are the others.

/// Of a group that is pulled to one direction.
struct PhasePull {
  double target_rad = 0.0;
  double gain_1_s = 0.0;
  /// [rad/s]
  double rate(double phi_rad) const { return gain_1_s * math::wrap_pi(target_rad - phi_rad); }
};

struct Leader {
  double gain_1_s = 0.0;  ///< α, 0: none
  double phi_rad = 0.0;   ///< φ₀
};

/// Of all-to-all coupling [M18 eq. 4.18, 4.26]. `sum` is that of the whole group but the leader.
PhasePull mean_field_pull(const CircularSum& sum, double k_1_s, const Leader& leader = {});

/// rate_rad_s[i] += Rule III. All spans have graph.size() elements; phases of a graph that is not
/// all-to-all are lifted, that of the leader too. O(N + edges), does not allocate.
void add_phase_coupling(const CouplingGraph& graph, double k_1_s, std::span<const double> phi_rad,
                        const Leader& leader, std::span<double> rate_rad_s);

/// φ in the turn that is nearest to `reference`: lifts one who joins, or a leader, to the others.
inline double nearest_turn(double phi_rad, double reference_rad) {
  return reference_rad + math::wrap_pi(phi_rad - reference_rad);
}

/// Every phase in the turn that is nearest to the circular mean, so that no two are more than 2π
/// apart. To be called when coupling begins and where a phase was set from outside. Any choice of
/// turns synchronises; this one has the shortest way to go.
void lift_phases(std::span<double> phi_rad);

}  // namespace mimesis::crowd
