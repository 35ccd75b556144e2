#pragma once
#include <optional>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "nodes/crowd/engine/agent.h"
#include "nodes/crowd/engine/crowd.h"
#include "nodes/crowd/scenario/scenario.h"

namespace mimesis::crowd {

/// Ids of all agents in a scenario, the same in every process: from 1, group by group, then the
/// external ones in their order.
class Roster {
 public:
  /// @throws ConfigError as starts(), places() and first_goals()
  explicit Roster(const Scenario& scenario);

  int agents() const { return static_cast<int>(first_external_ - 1); }  ///< without external ones
  int externals() const { return static_cast<int>(agents_.size()) - agents(); }
  AgentId external_id(int external) const {
    return first_external_ + static_cast<AgentId>(external);
  }
  /// Number of the external agent, or −1.
  int external(AgentId id) const;
  bool known(AgentId id) const { return id >= 1 && id <= agents_.size(); }

  /// State at the start; an external agent with the traits that it will have. Precondition:
  /// known(id).
  const Agent& start(AgentId id) const { return agents_[id - 1]; }
  int home(AgentId id) const { return homes_[id - 1]; }  ///< group that it begins in

 private:
  std::vector<Agent> agents_;
  std::vector<int> homes_;
  AgentId first_external_ = 1;
};

/// A scenario that runs: the crowd, and above it what changes its groups: the schedule, zones,
/// encounters, goals and routes, the beat. Pure; same scenario, same bits.
///
/// An agent that waits in a zone marks time: steps on the spot, in the rhythm of its group.
class ScenarioRun {
 public:
  struct Switch {
    AgentId id;
    int from, to;
  };

  /// @throws ConfigError as Crowd, and for a scenario that has faults
  explicit ScenarioRun(const Scenario& scenario);

  const Scenario& scenario() const { return scenario_; }
  const Roster& roster() const { return roster_; }
  Crowd& crowd() { return crowd_; }
  const Crowd& crowd() const { return crowd_; }
  double time_s() const { return crowd_.time_s(); }
  /// Phase of the scenario's beat at the present time, not wrapped [rad]. If an agent is the beat
  /// and no longer trusted, the phase continues at the beat's rate.
  double beat_rad() const;
  /// ω₀ of the gait that the group has at present.
  double eigenfrequency_rad_s(int group) const { return omega_[static_cast<std::size_t>(group)]; }
  /// Number of the gait that the group has at present.
  int gait(int group) const { return gaits_[static_cast<std::size_t>(group)]; }
  bool waiting(AgentId id) const;
  /// Where the agent wants to go in the end; its trait is the place that it heads for now, which is
  /// another one where walls are in the way.
  Eigen::Vector2d goal_W_m(AgentId id) const;
  /// A wish that agents walk in this style: they change to the first group with that gait. Without
  /// ids: all groups take the gait. Returns why not, or an empty text.
  std::string wish_gait(std::span<const AgentId> ids, const std::string& name);
  /// Changes of groups, then a step of the crowd.
  /// @throws ConfigError as Crowd if an agent cannot join a group: it stays in its own, and the
  ///         step was made
  void step(parallel::Team* team = nullptr);
  /// Switches in the last step, in the order in which they happened.
  std::span<const Switch> switches() const { return switches_; }
  /// Groups that got other rules or another gait, in the last step and since.
  std::span<const int> changed_groups() const { return changed_; }

 private:
  struct Course {
    int leg = 0;
    bool waiting = false;
    double stride = 1.0;  // when it does not wait
    Eigen::Vector2d goal_W_m = Eigen::Vector2d::Zero();
  };
  void add_group(const Group& group);
  void populate();
  void follow_schedule();
  void follow_goals();
  void follow_ways();
  void follow_zones();
  void gather(const Zone& zone, int from);
  void follow_encounters();
  void meet(const Encounter& encounter);
  void wait(AgentId id, bool on);
  void plan_switch(AgentId id, int from, int to);
  void make_switches();
  void move(AgentId id, int from, int to);
  void send_on(Agent& agent, int from, int to);
  void set_goal(AgentId id, const Eigen::Vector2d& goal);
  void set_gait(int group, const std::string& name);
  void hear_beat();
  std::optional<double> beat_of_agent() const;
  bool takes_part(int row) const;

  Scenario scenario_;
  Roster roster_;
  Crowd crowd_;
  std::vector<int> gaits_;     // gaits of the groups
  std::vector<double> omega_;  // their ω₀
  std::unordered_map<AgentId, Course> courses_;
  std::vector<std::optional<Ways>> ways_;  // of the groups that plan some
  std::uint64_t steps_ = 0;
  std::size_t next_change_ = 0;
  double beat_from_rad_ = 0.0, beat_from_s_ = 0.0;
  std::vector<Switch> switches_;
  std::vector<int> changed_;
  std::string trouble_;                       // trouble of this step
  std::vector<std::pair<double, int>> by_x_;  // scratch: rows of a group, by x
};

}  // namespace mimesis::crowd
