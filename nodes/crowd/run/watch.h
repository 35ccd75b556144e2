#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "nodes/crowd/certificate/monitor.h"
#include "nodes/crowd/engine/agent.h"
#include "nodes/crowd/rules/rules.h"
#include "nodes/crowd/run/scenario_run.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

/// An agent as others see it.
struct Observed {
  AgentId id = 0;
  int group = 0;
  bool coupled = true;    ///< takes part in its group's rules
  bool external = false;  ///< another process moves it
  double age_s = 0.0;     ///< of what is known of it
  Eigen::Vector2d p_W_m = Eigen::Vector2d::Zero();
  double heading_rad = 0.0, phase_rad = 0.0;
  double place_m = 0.0, lane_m = 0.0, radius_m = 0.25;
  Eigen::Vector2d goal_W_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d next_W_m = Eigen::Vector2d::Zero();  ///< on the way there: where it heads for now
  /// Addend of its ψ̇ by avoidance; NaN: not known.
  double avoid_rad_s = std::numeric_limits<double>::quiet_NaN();
};

/// How far a group is from what its rules are for.
struct GroupOrder {
  int agents = 0;
  GroupErrors errors{};
  double phase_most_rad = 0.0;  ///< largest deviation from the circular mean, of followers
  double place_most_m = 0.0;    ///< farthest from its place; across only if headings keep lanes
  double goal_most_m = 0.0;     ///< farthest from its goal
};

/// Measures groups; keeps its memory.
class Observer {
 public:
  /// @param rules   that the group has at the moment
  /// @param agents  those of the group that are coupled, by id
  /// @param beat_rad  phase of the leader if it is no agent
  /// @param sway_m    distance from their lanes that sway takes walkers to, Certificate::sway_m
  GroupOrder measure(const Group& group, const Rules& rules, std::span<const Observed> agents,
                     std::optional<double> beat_rad, double sway_m = 0.0);

 private:
  std::vector<double> phases_, headings_;
};

/// Goals that a group has to reach by its rules.
struct Wanted {
  bool phases = false, leader = false, places = false, headings = false, goals = false;
};
/// @param passes  agents come and go through zones: it is never to be in order as a whole
Wanted wanted_of(const Group& group, const Rules& rules, bool passes);

/// Angles within this are equal.
inline constexpr double kInOrder_rad = 0.02;
bool in_order(const Group& group, const Wanted& wanted, const GroupOrder& order, double formed_m);

/// Discs of agents in the plane: how near they came to each other, and how often two began to
/// overlap. O(N) where most are farther apart than the nearest two.
class Closeness {
 public:
  struct Disc {
    AgentId id;
    double x_m, y_m, radius_m;
  };

  /// @param slack_m  discs overlap if they do so by more than this
  explicit Closeness(double slack_m = 1e-3) : slack_m_(slack_m) {}

  /// Everybody at one instant, in any order.
  void observe(std::span<const Disc> discs);

  double least_gap_m() const { return least_gap_m_; }  ///< between two discs, since the start
  /// between two middles, since the start
  double least_distance_m() const { return least_distance_m_; }
  std::uint64_t collisions() const { return collisions_; }  ///< overlaps that began
  /// Pairs that overlap, smaller id first, ascending.
  std::span<const std::pair<AgentId, AgentId>> overlapping() const { return overlapping_; }

 private:
  void look(std::span<const Disc> discs, double reach_m);
  void meet(const Disc& a, const Disc& b);

  double slack_m_;
  double least_gap_m_ = std::numeric_limits<double>::infinity();
  double least_distance_m_ = std::numeric_limits<double>::infinity();
  std::uint64_t collisions_ = 0;
  std::vector<std::pair<std::int64_t, std::int64_t>> cells_;  // by disc, as the lists
  std::vector<std::int32_t> first_, next_;
  std::vector<std::pair<AgentId, AgentId>> overlapping_, before_;
};

/// Error of an agent's heading against its rule, where headings are disturbed by avoidance, in the
/// coordinates in which it decays exponentially: 2 tan(e/2) of the angle e to a goal; √(e² +
/// (ξ/Δz)²) of the angle to the direction of a lane and the way ξ to it. NaN where the rate is not
/// to be measured: avoidance changes it by more than a twentieth, or by an unknown amount, the goal
/// is nearer than the certificate holds for, the lane is far, or the rule has none.
double turn_error(const Group& group, const HeadingRule& rule, const RuleCertificate& certificate,
                  const Observed& agent);

/// Gives a monitor the state of all agents of a group in which each has turns of its own: some
/// avoid, or agents come and go.
void measure_turns(Monitor& monitor, const Group& group, const HeadingRule& rule,
                   std::span<const Observed> agents, double t_s);

enum class Rule { frequency, length, phase, tracking, heading };

/// Guaranteed and measured, of one rule of one group.
struct RuleLine {
  int group = 0;
  Rule rule = Rule::phase;
  RuleCertificate certificate{};
  RuleReport report{};
  double disorder = 0.0;  ///< the error that the rate was measured of
  int guests = 0;         ///< agents from outside: the guarantee is not of a group with some
};

/// Watches all groups of a run: certificates of the groups as they are, rates measured beside them,
/// since when everything is in order, and how people come into step where a beat is. Bodies of
/// external agents are never quite as theory has them: rates of a group with some are measured
/// until it is in order.
class Watch {
 public:
  /// With the groups as the scenario begins them.
  explicit Watch(const ScenarioRun& run);

  /// All agents at one time, by group and id. A group with other members or rules than in its
  /// certificate gets a new one.
  void observe(const ScenarioRun& run, double time_s, std::span<const Observed> everybody);
  /// Why the next change of a group's members will be; else they just changed.
  void expect_change(int group, std::string reason);

  std::vector<RuleLine> lines() const;
  /// The rule in force with the least guaranteed rate; one without guarantee goes before all.
  std::optional<RuleLine> weakest() const;
  int number() const { return number_; }  ///< number of certificates made, from 1
  /// Why the certificates before the present ones do not hold any more, since the last call.
  std::string take_voided();

  bool in_order() const { return since_s_ >= 0.0; }
  double in_order_since_s() const { return since_s_; }  ///< negative: it is not
  /// number of agents that its certificate is for
  int agents(int group) const;
  /// Names the groups and rules that are not in order.
  std::string disorder(const ScenarioRun& run) const;
  double place_most_m() const;  ///< farthest from its place, of groups with a formation
  /// A rule was measured to be slower than guaranteed, in a group without agents from outside.
  bool broken() const;

  /// Entrances into a group that hears the beat, through a zone where people gather: number, and
  /// phase errors as they came.
  struct Entrances {
    int count = 0, wrong_foot = 0;  ///< wrong: more than a quarter of a cycle off
    double most_rad = 0.0;
  };
  const Entrances& entrances() const { return entrances_; }

 private:
  /// Errors that were in order since the certificate, of a group with bodies.
  struct Settled {
    bool phase = false, tracking = false, spacing = false, heading = false;
  };
  struct Kept {
    Monitor monitor;
    GroupOrder order;
    std::string expected;
    Wanted wanted;
    bool passes = false;
    HeadingKind heading = HeadingKind::keep;  // of the certificate
    bool turned = false;                      // where headings point is not known
    int guests = 0;                           // coupled agents from outside
    double age_s = 0.0;                       // of them, in the certificate
    double older_s = 0.0, seen_s = 0.0;       // the oldest since a time
    Settled settled;
  };
  void certify(const ScenarioRun& run, int group, int agents, const std::string& why);
  void measure(const ScenarioRun& run, int group, double time_s);
  void greet(const ScenarioRun& run, const Observed& agent, double beat_rad);
  std::string change_of(const ScenarioRun& run, int group, int agents) const;
  std::string aged(Kept& kept, double time_s) const;

  std::vector<Kept> groups_;
  std::vector<int> last_group_;  // group of every id
  std::vector<Observed> members_;
  Observer observer_;
  std::string voided_;
  int number_ = 1;
  double since_s_ = -1.0;
  Entrances entrances_;
};

}  // namespace mimesis::crowd
