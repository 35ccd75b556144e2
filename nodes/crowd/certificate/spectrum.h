#pragma once
#include <Eigen/Core>

#include "nodes/crowd/graph/coupling_graph.h"

namespace mimesis::crowd {

/// Smallest and largest eigenvalue of a Laplacian on the complement of synchrony (1, ..., 1).
struct Extremes {
  double least = 0.0;  ///< λ⁺, the algebraic connectivity; 0 exactly where parts are not connected
  double most = 0.0;  ///< λ_max
  bool exact = true;  ///< else bounds from below and above
  /// α = λ⁺/λ_max in [0, 1]; 1 for fewer than two agents.
  double ratio() const { return most > 0.0 ? least / most : 1.0; }
};

/// Eigenvalues of the Laplacian of a named graph of n ≥ 1 nodes, ascending: closed forms, O(n)
/// [M18 A.2]. @throws ConfigError for Topology::weighted, n < 1 and a wheel of fewer than four
Eigen::VectorXd spectrum(Topology topology, int n);
/// The same of any graph; of a weighted one by Eigen, O(n³).
Eigen::VectorXd spectrum(const CouplingGraph& graph);

/// λ⁺ and λ_max, O(1) for named graphs. A weighted graph of more than 600 nodes gets bounds
/// instead: λ⁺ ≥ 4 w/(n diam) [M18 A.1, Mohar], diam at most twice the eccentricity of node 0, w
/// the least weight; λ_max ≤ max (dᵢ + dⱼ) over edges [Anderson, Morley].
Extremes extremes(Topology topology, int n);
Extremes extremes(const CouplingGraph& graph);

/// λ⁺ of n unit-weight agents, all-to-all, after `links` links broke, none two at one agent:
/// n − 2 with one or more [M18 B.3.4]. λ_max stays n while one agent keeps all of its links.
/// @pre 0 <= 2 links <= n
Extremes all_to_all_without(int n, int links);

/// λ⁺ when the link has broken whose loss is worst: 0 for chains and stars, that of a chain for a
/// ring, n − 2 for all-to-all. Of wheels and weighted graphs of up to 30 nodes by Eigen, of larger
/// ones Weyl's bound, or 0.
double connectivity_without_link(const CouplingGraph& graph);

/// Bound from below on λ⁺ when one link of weight w goes: λ⁺ − 2w, by Weyl's theorem [M18 A.6].
inline double after_lost_link(double connectivity, double weight) {
  return connectivity - 2.0 * weight;
}
/// The same when one agent of a unit-weight graph goes: λ⁺ − 1 [Fiedler].
inline double after_lost_agent(double connectivity) { return connectivity - 1.0; }

}  // namespace mimesis::crowd
