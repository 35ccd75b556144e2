#pragma once
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "nodes/crowd/certificate/contraction.h"
#include "nodes/crowd/rules/gait.h"
#include "nodes/crowd/rules/rules.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

enum class Guarantee {
  off,          ///< the rule is not in force
  none,         ///< nothing is known, or it diverges
  contracting,  ///< converges exponentially, at least at `guaranteed_1_s`
};
const char* to_string(Guarantee guarantee);

/// Guarantee of contraction theory for one rule in one group. Rates are of differences between
/// agents (of angles, of distances to places).
struct RuleCertificate {
  Guarantee guarantee = Guarantee::off;
  double guaranteed_1_s = 0.0;  ///< bound from below on the rate; 0 unless contracting
  double expected_1_s = 0.0;    ///< rate near the goal, averaged over a gait cycle
  double within = 0.0;          ///< the bound holds for errors up to this [m or rad]; 0: all
  /// the bound holds while goals are farther than this; 0: everywhere
  double beyond_m = 0.0;
  double overshoot = 1.0;         ///< factor by which differences may grow before they decay [1]
  Extremes extremes{};            ///< eigenvalues of the coupling graph, if there is one
  double without_link_1_s = 0.0;  ///< the bound when the worst of its links has broken; 0: none
  double theorem6 = 0.0;  ///< ζ² + η² of graph and gait, rules I and II; below 1: no overshoot
  std::optional<int>
      /// largest number of agents that meets theorem 6 with this graph; empty: any number
      largest_agents{};
  std::string why{};  ///< one sentence
  /// changes that would improve the guarantee; empty: none is needed
  std::vector<std::string> change{};
};

struct Certificate {
  int agents = 0;
  RuleCertificate frequency, length, phase, tracking, heading;  ///< tracking: to the leader
  /// Distances between agents oscillate by up to this after convergence: rule I while phases
  /// differ, as g(φᵢ) differ [M18 4.4.2, 2]. 0: none.
  double residual_m = 0.0;
  std::vector<std::string> notes{};  ///< on rules that act together

  /// Every rule in force is contracting.
  bool holds() const;
  /// The slowest guaranteed rate of the rules in force, that of the whole hierarchy [M18 4.4.2, 3];
  /// empty if there are none or one has no guarantee.
  std::optional<double> rate_1_s() const;
};

/// How the group to be certified walks.
struct GaitRange {
  SpeedFunction gait;
  double eigenfrequency_rad_s = 0.0;  ///< ω
  double spread_rad_s = 0.0;          ///< eigenfrequencies within ω ± this
  double beat_gain_1_s = 0.0;         ///< α to a rhythm from outside, that leads all n; 0: none
  HeadingSway sway{};                 ///< g^ψ of lane and consensus headings
};

/// Guarantees for n agents with these rules: rates, largest number of agents, and advice. Never
/// throws: a graph that does not exist or is not connected is a guarantee of `none` with the
/// reason. n < 2: nothing to agree on.
Certificate certify(const Rules& rules, int n, const GaitRange& gait);

/// Time after which no agent of a group with rules II and III, and IV or keep, is farther than
/// `tolerance_m` from its place relative to any other, from every start of phases and from places
/// that are off by up to `error_m` (max − min of z − d) and lanes by `lane_m`: an upper bound;
/// formations stand much earlier. Empty without rules II and III contracting, or where
/// `tolerance_m` is not positive.
/// @param ahead_m  z − d of every agent at the start, for a tighter bound on graphs other than
///                 all-to-all; none: anywhere within error_m
std::optional<double> formation_time_s(const Certificate& certificate, const Rules& rules,
                                       const GaitRange& gait, double error_m, double lane_m,
                                       double tolerance_m, std::span<const double> ahead_m = {});

/// A group between two changes of its rules or gait.
struct Stage {
  std::string group, gait;
  double from_s = 0.0;
  Rules rules{};
  int agents = 0;  ///< external ones included
  Certificate certificate{};
  /// Bound on the time to formation from the start [s], of first stages (formation_time_s).
  std::optional<double> formation_s{};
};

/// Certificates of all groups, in the order of groups and time.
/// @pre faults(scenario) is empty
std::vector<Stage> certify(const Scenario& scenario);

/// Largest number of agents that theorem 6, and the weak condition [M18 B.14], allow with a gait.
struct TopologyLimit {
  Topology topology = Topology::none;
  std::optional<int> theorem6{}, weak{};  ///< nothing: any number
};

std::vector<TopologyLimit> topology_limits(const SpeedFunction& gait);

}  // namespace mimesis::crowd
