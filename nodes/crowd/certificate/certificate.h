#pragma once
#include <optional>
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

/// Guarantee of contraction theory for one rule in one group. Rates are of the error e of all
/// agents, the root of its squares: of φ to the mean phase (I, III), of z − d to its mean (II), of
/// ψ to the mean or wished one, tan(D/2) of the arc D of a consensus, tan(e/2) to a goal; largest
/// of |φ − φ₀| (tracking). They are bounds of |e| <= overshoot |e₀| exp(−rate t) while e is
/// `within`, or, where `in_the_end`, of −d log|e|/dt for t → ∞ of what comes near its goal. Where
/// phases do not agree the errors of I and II are differences to the motion that all come to, in
/// which distances oscillate.
struct RuleCertificate {
  Guarantee guarantee = Guarantee::off;
  double guaranteed_1_s = 0.0;  ///< bound from below on the rate; 0 unless contracting
  double expected_1_s = 0.0;    ///< rate near the goal, averaged over a gait cycle
  /// the bound holds up to this: sums Σⱼ Aᵢⱼ (zᵢ − zⱼ − dᵢⱼ) of I and II [m], range of phases (the
  /// leader's too) and headings [rad]; 0: all
  double within = 0.0;
  /// the bound holds while goals are farther than this; 0: everywhere
  double beyond_m = 0.0;
  /// the bound is that of small errors, once others have settled: nothing is said about the way
  /// there
  bool in_the_end = false;
  /// what remains of the error in the end, at most [as the error]: e decays to it, not to 0;
  /// infinite: it is not known. Of phases it is how far unequal paces lock apart.
  double remains = 0.0;
  /// others, walls and pillars may hold walkers up: nothing is said while somebody is near them
  bool while_free = false;
  /// rule II, where it waits: the bound holds to a hundredth where its error is 100 times larger
  /// than what others still add, `per_phase_m_rad` times the range of phases plus `per_lane_m`
  /// times the square of the lanes' error
  double per_phase_m_rad = 0.0, per_lane_m = 0.0;
  double overshoot = 1.0;         ///< factor of the bound: differences may first grow [1]
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
  double sway_m = 0.0;                                          ///< from their lanes, by sway
  std::vector<std::string> notes{};                             ///< on rules that act together

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
  double beat_rate_rad_s = 0.0;       ///< of that rhythm
  HeadingSway sway{};                 ///< g^ψ of lane and consensus headings
  double off_path_rad = 0.0;  ///< largest angle between headings that are kept and the path; π: any
  double step_s = 0.0;        ///< of the engine; 0: continuous time
  int guests = 0;             ///< agents from outside, that do what their commands say
  double age_s = 0.0;         ///< their states are no older, nor are their commands when they come
};

/// Guarantees for n agents with these rules: rates, largest number of agents, and advice. Steps of
/// the engine leave 98 % of a rate or more, and at most 0.2/step_s is guaranteed. Never throws: a
/// graph that does not exist or is not connected is a guarantee of `none` with the reason. n < 2:
/// nothing to agree on.
Certificate certify(const Rules& rules, int n, const GaitRange& gait);

/// A group of a scenario as it is at some time: all that its certificate depends on, for whoever
/// asks.
struct GroupNow {
  int group = 0;
  Rules rules{};
  int gait = 0;         ///< number in Scenario::gaits
  int agents = 0;       ///< external ones included
  int guests = 0;       ///< the external ones
  double age_s = 0.0;   ///< of what is known of them
  bool turned = false;  ///< a rule of headings was in force before: where they point is not known
};
Certificate certify(const Scenario& scenario, const GroupNow& now);

/// A group between two changes of its rules or gait.
struct Stage {
  std::string group, gait;
  double from_s = 0.0;
  Rules rules{};
  int agents = 0;  ///< external ones included
  Certificate certificate{};
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
