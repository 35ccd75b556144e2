#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>

#include "nodes/crowd/rules/coupling_graph.h"

namespace mimesis::crowd {

/// Smallest and largest eigenvalue of a Laplacian on the complement of synchrony (1, ..., 1).
struct Extremes {
  double least = 0.0;  ///< λ⁺, the algebraic connectivity; 0 exactly where parts are not connected
  double most = 0.0;  ///< λ_max
  bool exact = true;  ///< false: bounds from below and above
  bool directed = false;
  /// factor by which an error that decays at λ⁺ may first grow where the graph is directed [1]
  double skew = 1.0;
  /// α = λ⁺/λ_max in [0, 1]; 1 for fewer than two agents.
  double ratio() const { return most > 0.0 ? least / most : 1.0; }
};

/// λ⁺ and λ_max: closed forms for named graphs, O(1) [M18 A.2]; a weighted one is solved by Eigen,
/// O(n³), and of more than 600 nodes gets bounds instead: λ⁺ ≥ 4 w/(n diam) [M18 A.1, Mohar], diam
/// at most twice the eccentricity of node 0, w the least weight; λ_max ≤ max (dᵢ + dⱼ) over edges
/// [Anderson, Morley].
///
/// Of a strongly connected directed graph, with πᵀL = 0, Σπ = 1 and Π = diag π, ẋ = −L x contracts
/// in the metric Π: (x − πᵀx 1) decays at half the second eigenvalue of Π^½LΠ^-½ + its transpose,
/// which is λ⁺ here; Euclidean it may first grow by √(π_max/π_min). [Olfati-Saber, Murray 2004] for
/// balanced graphs. λ_max is a bound of |λ|. Zero where it is not strongly connected, and for more
/// than 600 nodes.
Extremes extremes(Topology topology, int n);
Extremes extremes(const CouplingGraph& graph);

/// λ⁺ after the worst loss of one link: 0 for chains and stars, the chain's value for a ring, n − 2
/// for all-to-all [M18 B.3.4], of directed ones 0: not known. For wheels and weighted graphs of up
/// to 30 nodes by Eigen; for larger ones, where a link of weight w goes, Weyl's bound λ⁺ − 2w [M18
/// A.6], or 0.
double connectivity_without_link(const CouplingGraph& graph);

// Contraction of φ̇ = −m L G(φ), m > 0, on the complement of synchrony: its Jacobian there is
// −m Λ D̃, Λ the eigenvalues of L but the zero, D̃ that of D = diag(g(φᵢ)) [M18 4.4.2, B.3].
//
// In the Euclidean norm Λ D̃ + D̃ Λ > 0 is wanted. Known by the ranges of both alone, that holds if
// ζ² + η² < 1 (theorem 6), with α = λ⁺/λ_max and β = g_min/g_max. This limits topology and N.
//
// In the constant metric Λ⁻¹, which eq. 4.9 of [M18] allows, the Jacobian is −m Λ^½ D̃ Λ^½:
// symmetric, at most −m g_min λ⁺. So for every connected graph and every g > 0 differences decay at
// least at m g_min λ⁺; where theorem 6 does not hold they may first grow, by √(λ_max/λ⁺) at most.

/// (1 − r)/(1 + r): ζ of α, η of β.
inline double half_range(double ratio) { return (1.0 - ratio) / (1.0 + ratio); }

/// ζ² + η² [M18 B.10]: below 1 the anticommutator is positive definite for all eigenvectors; at and
/// above 1 there are eigenvectors for which it is not (theorem 6). For a Laplacian and a diagonal D
/// the condition is sufficient only.
double theorem6_sum(double alpha, double beta);
/// β > (1 − α)/(1 + α) [M18 B.13], narrower.
inline bool weak_condition(double alpha, double beta) { return beta > half_range(alpha); }
/// Condition on the topology and the gait, for `largest_agents`.
enum class Condition { theorem6, weak };

/// Largest N whose graph of this kind meets the condition with β = g_min/g_max; at least 2, a ring
/// 3, a wheel 4, which are all-to-all. Empty if every N does. @pre 0 < beta <= 1, named topology
std::optional<int> largest_agents(Topology topology, double beta, Condition condition);

/// Bound from above on β: the least β = g_min/g_max with which a graph of this α meets theorem 6.
double least_gait_ratio(double alpha);

/// Contraction with the low-pass ε̇ = α_f (L G(φ) − ε), φ̇ = −m ε: in the coordinates of [M10] and
/// the metric Λ⁻¹ the symmetric Jacobian falls into two blocks, −m S and −(α_f − m S) with
/// S = Λ^½ D̃ Λ^½, for every graph (in the Euclidean norm, as printed, for all-to-all alone). Hence
/// min (m g_min λ⁺, α_f − m g_max λ_max); positive if α_f > m g_max λ_max. [M10] writes
/// ż = −α z + G, φ̇ = −m' L z: with its m' = m α_f this is its bound α > √(m' g_max λ_max).
double low_pass_rate(double m, double low_pass_rad_s, double g_least, double g_most,
                     double lambda_least, double lambda_most);

/// Bound on the rate of ė = −A e where some agents are known by states of up to `age_s` ago, each
/// carried on at its rates, and get their commands as late. rate: of −A; stiffness: ‖A‖. With
/// E = ½ (κτ)² (1 + κτ)², how far a carried-on error is from the present one, what delays add is at
/// most κ (2E + κτ (1 + E)) times the largest error of the last 3τ, so that the rate r has
/// r = rate − that exp(3τ r) [Halanay 1966]. 0: nothing is known.
double late_rate(double rate_1_s, double stiffness_1_s, double age_s);

/// Slowest mode of the same with constant g, from s = m g λ⁺, the rate without low-pass:
/// (α/2)(1 − √(1 − 4 s/α)), or α/2 where it oscillates. [1/s]
double low_pass_mode_rate(double low_pass_rad_s, double slope_1_s);

/// Rate of decay of ẋ = A(φ) x per radian, A of period 2π: −ln r/2π, r the largest size of an
/// eigenvalue of its map over one period [Floquet]; below zero it grows. By Runge and Kutta's
/// method; allocates nothing. An A too stiff for that is a rate below zero.
double periodic_rate(const std::function<Eigen::Matrix2d(double phi_rad)>& a);
double periodic_rate_of_three(const std::function<Eigen::Matrix3d(double phi_rad)>& a);

}  // namespace mimesis::crowd
