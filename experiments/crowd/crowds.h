#pragma once
#include <random>
#include <span>
#include <vector>

#include "nodes/crowd/engine/crowd.h"

namespace mimesis::crowd {

/// Step frequency of figures of [M18 4.3, 4.4].
inline constexpr double kOmega_rad_s = 6.0;
/// ⟨g⟩ of agents that keep their distances by step frequency.
inline constexpr double kMean_m_rad = 0.2;

/// n values in [least, most).
std::vector<double> uniform(int n, double least, double most, std::mt19937_64& draw);

/// One group along W's x axis, agents with ids from 1, these phases and `kOmega_rad_s`.
Crowd one_group(const Rules& rules, std::span<const double> phi_rad, double dt_s);
/// The same of any agents.
Crowd one_group(const GroupSettings& group, std::span<const Agent> agents, double dt_s);

/// g with one harmonic of two steps a cycle: ⟨g⟩ (1 + a cos 2φ).
SpeedFunction gait_of(double amplitude);
/// Agents that keep their distances by the frequency of their steps alone [M18 eq. 4.28, 4.29; M10
/// with a low-pass]. zᵢ = G(φᵢ) + dᵢ: phases decide about places, cᵢ = dᵢ, so formation is
/// synchrony.
Crowd tied_crowd(const FrequencyRule& rule, const SpeedFunction& gait,
                 std::span<const double> place_m, std::span<const double> phi_rad, double dt_s);
/// max − min of z − d.
double formation_error_m(const Crowd& crowd);

/// Two streams that cross at right angles, 0.25 agents/m², every agent on a lane, steps in
/// synchrony by mean field, spacing by step frequency and length: every rule at once. Steps of 1/60
/// s.
Crowd crossing_crowd(int n);

/// Everybody to the opposite place of a disc, 0.25 agents/m².
Crowd circle_crowd(int n);

/// A formation without navigation: rules I, II and III by mean fields.
Crowd formation_crowd(int n);

/// On a circle of 40 m, every agent to the opposite place. Steps of 20 ms, like the next ones.
Crowd ring_crowd(int n);

/// Pairs 10 m apart that change places, exactly head on.
Crowd head_on_crowd(int pairs);

/// Agents within a distance of their goals.
int arrived(const Crowd& crowd, double within_m);

}  // namespace mimesis::crowd
