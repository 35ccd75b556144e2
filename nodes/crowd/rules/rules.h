#pragma once
#include <cmath>
#include <span>
#include <vector>

#include "nodes/crowd/rules/coupling_graph.h"
#include "nodes/crowd/rules/lanes.h"

// The control rules I-IV of a crowd [M18 4.4]: their settings, and their equations as functions of
// one agent. The engine calls these functions in its loops over agents, and no others.
//
// zᵢ is the place of agent i along the path, dᵢ its wished place among the others, so that
// dᵢⱼ = dᵢ − dⱼ and the wished distances are consistent. φ is the phase of the gait, ψ the heading,
// + to the left, μ the relative change of the step length.
namespace mimesis::crowd {

/// A coupling graph by its name, or by edges if the topology is `weighted`.
struct GraphSettings {
  Topology topology = Topology::none;
  std::vector<Edge> edges{};
  bool directed = false;  ///< of the edges: i hears j, but j does not hear i
};

/// Settings of rule I: step frequency keeps distances.
struct FrequencyRule {
  GraphSettings graph{};
  double gain_rad_m_s = 0.0;    ///< m_d, 0: off
  double saturation_m = 0.0;    ///< limit of the summed error, 0: none
  double low_pass_rad_s = 0.0;  ///< α of the low-pass, 0: none [M10]
};

/// Settings of rule II: step length keeps distances.
struct LengthRule {
  GraphSettings graph{};
  double gain_1_m = 0.0;  ///< m_z, 0: off
  double limit = 0.5;     ///< largest |μ|, (0, 1) [1]
};

/// Settings of rule III: phases synchronise.
struct PhaseRule {
  GraphSettings graph{};
  double gain_1_s = 0.0;         ///< k, 0: off
  double leader_gain_1_s = 0.0;  ///< α, 0: no leader; else agent 0 of the group leads
};

enum class HeadingKind {
  keep,       ///< goes straight on
  lane,       ///< to the sliding goal on its line [M18 eq. 4.32]
  consensus,  ///< to the mean heading, quorum sensing [M18 eq. 4.33]
  coupled,    ///< to its neighbours, Schöner-Dose [M18 eq. 4.41, 4.45]
  goal        ///< to a place of its own [M18 eq. 3.25]
};

/// Settings of rule IV: headings. With `avoid`, the terms of the navigation dynamics are added
/// [M18 eq. 3.26, 3.27].
struct HeadingRule {
  HeadingKind kind = HeadingKind::keep;
  GraphSettings graph{};  ///< for `coupled`
  /// m_ψ of lane and consensus, per radian of gait [1]; k of coupled and goal [1/s]
  double gain = 1.0;
  double ahead_m = 2.0;     ///< Δz of the sliding goal
  double low_pass_s = 0.0;  ///< τ of the consensus variable χ, 0: none
  double spread_rad = 0.0;  ///< σ of the shunting Gaussian of `coupled`, 0: none
  bool avoid = false;
};

/// Constants of the navigation dynamics but for the goal's gain, which is the heading rule's.
/// Angles are wrapped before they enter.
struct NavigationParams {
  double avoid_1_s = 2.0;         ///< gain of eq. 3.26
  double predict_1_s = 2.0;       ///< gain of eq. 3.27
  double sigma_angle_rad = 0.6;   ///< σ_φ
  double sigma_distance_m = 0.8;  ///< σ_d
  /// Predicted collisions count less the further ahead they are: exp(−t/horizon).
  double horizon_s = 3.0;
  /// Two characters that meet head on are exactly between left and right, where the sines are zero.
  /// So each adds this angle to the left to the other's direction, and passes on the right.
  double keep_right_rad = 0.1;
};

/// Obstacles of all agents.
struct Pillar {
  Eigen::Vector2d position_W_m = Eigen::Vector2d::Zero();
  double radius_m = 0.3;
};
struct Wall {
  Eigen::Vector2d from_W_m = Eigen::Vector2d::Zero(), to_W_m = from_W_m;
};

/// Rules by which agents of one group react to each other.
struct Rules {
  FrequencyRule frequency{};
  LengthRule length{};
  PhaseRule phase{};
  HeadingRule heading{};
};

/// Mean field of angles on the circle: Σ cos, Σ sin and their number. Sums of parts of a crowd add
/// up.
struct CircularSum {
  double cos = 0.0, sin = 0.0;
  double count = 0.0;

  void add(double angle_rad) {
    cos += std::cos(angle_rad);
    sin += std::sin(angle_rad);
    count += 1.0;
  }
  /// arg Σ e^{iφ} in [-π, π] rad; 0 without angles.
  double angle() const { return std::atan2(sin, cos); }
};

/// Adds in the order given.
CircularSum circular_sum(std::span<const double> angles_rad);
/// R̂ = √(1 − |Σ e^{iφ}|/N) [1], 0 in synchrony [M18 4.3.6]. Near synchrony it is σ_φ/√2; for that
/// 1 − |·| is computed as the mean of 2 sin²((φ − φ̂)/2), which keeps its digits.
double dispersion(std::span<const double> phi_rad);
/// Largest distance of an angle from the circular mean [rad], [0, π].
double spread(std::span<const double> angles_rad);

// Rules I and II act on the error eᵢ = Σⱼ Aᵢⱼ (zᵢ − zⱼ − dᵢⱼ), zero in formation.

/// eᵢ along a graph [m]. All spans have graph.size() elements. O(N + edges), all-to-all by the sum;
/// does not allocate.
void spacing_errors(const CouplingGraph& graph, std::span<const double> z_m,
                    std::span<const double> d_m, std::span<double> error_m);

/// eᵢ in an all-to-all group of n: n (zᵢ − dᵢ) − Σⱼ (zⱼ − dⱼ).
inline double mean_field_error(double ahead_m, double sum_m, double n) {
  return n * ahead_m - sum_m;
}

/// sat(e) = limit · tanh(e/limit): odd, slope 1 at zero, within ±limit; the logistic function of
/// [M10], centred so that the sum of the corrections is zero in formation. Limit 0: e itself.
inline double saturate(double e, double limit) { return limit > 0.0 ? tanh_lane(e, limit) : e; }

/// Rule I: addend of φ̇ [rad/s], −m_d e, where e is the error, the state ε of its low-pass, or
/// sat of either [M18 eq. 4.28].
inline double frequency_change(double gain_rad_m_s, double error_m) {
  return -gain_rad_m_s * error_m;
}

/// Low-pass ẋ = (u − x)/τ over one step of constant u: x + share (u − x), share = 1 − e^{−dt/τ}.
/// For ε of rule I, τ = 1/α: [M10] filters with gain 1/α, so its m is our m_d α, and its bound
/// α > √(m g_max λ_max) is α > m_d g_max λ_max.
inline double low_passed(double x, double u, double share) { return x + share * (u - x); }
inline double low_pass_share(double dt_over_tau) { return -std::expm1(-dt_over_tau); }

/// Rule II: μ = −m_z e within ±limit, where length scales speed linearly [M18 eq. 4.30, M10].
inline double step_length_change(double gain_1_m, double limit, double error_m) {
  return clamp_lane(-gain_1_m * error_m, limit);
}

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

/// The direction that all of an all-to-all group are pulled to, and how strongly.
struct PhasePull {
  double target_rad = 0.0;
  double gain_1_s = 0.0;
  /// Addend of φ̇ [rad/s].
  double rate(double phi_rad) const { return gain_1_s * wrap_lane(target_rad - phi_rad); }
};

struct Leader {
  double gain_1_s = 0.0;  ///< α, 0: none
  double phi_rad = 0.0;   ///< φ₀
};

/// The pull of all-to-all coupling [M18 eq. 4.18, 4.26]. `sum` is over the whole group without the
/// leader.
PhasePull mean_field_pull(const CircularSum& sum, double k_1_s, const Leader& leader = {});

/// rate_rad_s[i] += Rule III. All spans have graph.size() elements; phases of a graph that is not
/// all-to-all are lifted, the leader's too. O(N + edges), does not allocate.
void add_phase_coupling(const CouplingGraph& graph, double k_1_s, std::span<const double> phi_rad,
                        const Leader& leader, std::span<double> rate_rad_s);

/// φ in the turn that is nearest to `reference`: lifts an agent that joins, or a leader, to the
/// others.
double nearest_turn(double phi_rad, double reference_rad);

/// Every phase in the turn that is nearest to the circular mean, so that no two are more than 2π
/// apart. To be called when coupling begins and where a phase was set from outside. Any choice of
/// turns synchronises; this one has the shortest way to go.
void lift_phases(std::span<double> phi_rad);

// Rule IV: ψ̇ of one agent [rad/s]. Goals are vectors (x, y) = r e^{iψ_goal}, so that no angle is
// computed: r sin(ψ_goal − ψ) = y cos ψ − x sin ψ.

/// {r cos(ψ_goal − ψ), r sin(ψ_goal − ψ)} of a goal at (x, y), seen from the heading e^{iψ}.
inline CosSin seen_from(CosSin heading, double x, double y) {
  return {heading.cos * x + heading.sin * y, heading.cos * y - heading.sin * x};
}

struct Turn {
  double rate_rad_s;
  double facing;  ///< cos(ψ_goal − ψ): how far the agent goes where its goal is
};

/// φ̇ m_ψ sin(ψ_goal − ψ) to the sliding goal Δz ahead on the agent's line,
/// ψ_goal = ψ_path − atan((ξ − lane)/Δz) [M18 eq. 4.32, fig. 4.9b].
/// @param off_path    e^{i(ψ − ψ_path)}
/// @param to_lane_m   lane − ξ, + where the line is to the left
inline Turn lane_turn(double gain, double phi_rate_rad_s, CosSin off_path, double to_lane_m,
                      double ahead_m) {
  const double r = std::sqrt(to_lane_m * to_lane_m + ahead_m * ahead_m);
  const CosSin goal = seen_from(off_path, ahead_m, to_lane_m);
  return {phi_rate_rad_s * gain * goal.sin / r, goal.cos / r};
}

/// φ̇ m_ψ sin(χ − ψ) to the common direction e^{iχ}, arg Σ e^{iψ} behind its low-pass [M18
/// eq. 4.33].
inline double consensus_turn(double gain, double phi_rate_rad_s, CosSin heading, CosSin chi) {
  return phi_rate_rad_s * gain * seen_from(heading, chi.cos, chi.sin).sin;
}

/// k Σⱼ sin(ψⱼ − ψ) in an all-to-all group, from Σ e^{iψ} [M18 eq. 4.41 without the Gaussian].
inline double coupled_turn(double k_1_s, CosSin heading, CosSin sum) {
  return k_1_s * seen_from(heading, sum.cos, sum.sin).sin;
}

/// k sin(ψ_goal − ψ) to a place r away in direction (x, y)/r [M18 eq. 3.25].
/// @param per_r  1/r
inline Turn goal_turn(double k_1_s, CosSin heading, double x_m, double y_m, double per_r) {
  const CosSin goal = seen_from(heading, x_m, y_m);
  return {k_1_s * goal.sin * per_r, goal.cos * per_r};
}

/// rate[i] += k Σⱼ Aᵢⱼ sin(Δψ) exp(−Δψ²/2σ²), Δψ = ψⱼ − ψᵢ wrapped, k = rule.gain,
/// σ = rule.spread_rad, 0: without the Gaussian [M18 eq. 4.41, 4.45: A, for with the Laplacian's
/// signs it would repel]. Contracts while all are within π/2 of each other, at kλ⁺ in the end.
/// O(N + edges), all-to-all O(N²). Does not allocate.
void add_heading_coupling(const CouplingGraph& graph, const HeadingRule& rule,
                          std::span<const double> psi_rad, std::span<double> rate_rad_s);

}  // namespace mimesis::crowd
