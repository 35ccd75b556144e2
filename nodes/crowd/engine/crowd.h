#pragma once
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>

#include "nodes/crowd/engine/agent.h"
#include "nodes/crowd/rules/gait.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::parallel {
class Team;
}

namespace mimesis::crowd {

/// Line that a group walks along; z counts along it, ξ across, + to the left.
struct Path {
  Eigen::Vector2d origin_W_m = Eigen::Vector2d::Zero();
  double direction_rad = 0.0;
};

struct GroupSettings {
  Rules rules{};
  SpeedFunction gait;
  Path path{};
  HeadingSway sway{};  ///< sway of lane and consensus headings
};

/// Navigation [M18 eq. 3.24-3.27] of groups whose heading rule says `avoid`, and the bounds of
/// their velocities that keep discs apart. An agent that is held back marks time: its phase
/// continues.
struct AvoidSettings {
  NavigationParams navigation{};
  double reach_m = 5.0;    ///< others further away are not seen
  double headway_s = 0.3;  ///< gaps close at most as exp(−t/headway)
  double separate_m_s =
      0.5;                ///< how fast agents who begin in each other leave, and others make room
  double arrive_m = 0.5;  ///< goal: slower within this distance
};

struct CrowdSettings {
  double dt_s = 0.02;
  AvoidSettings avoid{};
};

/// Many walkers. Speed of agent i is vᵢ = stride (1 + μᵢ) φ̇ᵢ g(φᵢ) [M18 4.4.1]; φ̇, μ and ψ̇ follow
/// the rules of its group, by the two-step method of Adams and Bashforth (order 2, one evaluation a
/// step); the way along a step is the exact integral of g.
///
/// Within a group, agents are ordered by id: the i-th coupled one is node i of the coupling graphs,
/// the first leads. A named graph is rebuilt when agents join or leave; a weighted graph loses the
/// edges of an agent that leaves, and one that joins has none. All-to-all rules cost O(N): phases
/// follow the circular mean, φ̇ᵢ += k N wrap(arg Σ e^{iφ} − φᵢ). On other graphs phases are not
/// wrapped, so that they synchronise from every start.
///
/// The result depends neither on the order in which agents were added nor on the number of threads
/// nor on the instruction set. A step does not allocate, once one has run.
class Crowd {
 public:
  /// @pre faults(Scenario) finds none in the rules, here and below
  explicit Crowd(const CrowdSettings& settings);
  ~Crowd();
  Crowd(Crowd&&) noexcept;
  Crowd& operator=(Crowd&&) noexcept;

  /// Number of the new group, from 0.
  /// @throws ConfigError for edges that are none
  int add_group(const GroupSettings& settings);
  /// At run time. @throws ConfigError as `add_group`, and where a gain is too large for dt; nothing
  /// has changed then.
  void set_rules(int group, const Rules& rules);
  void set_gait(int group, const SpeedFunction& gait, const HeadingSway& sway = {});
  const GroupSettings& group(int group) const;
  int groups() const;

  /// @throws ConfigError for an id that exists already, values that are not finite or out of
  ///         range, and if gains are too large for dt with this number of agents; then nothing
  /// changes.
  void add(int group, std::span<const Agent> agents);
  /// Number of those that were there.
  int remove(std::span<const AgentId> ids);
  int remove(AgentId id) { return remove(std::span<const AgentId>(&id, 1)); }

  /// State set from outside: of external agents when a message comes, of own agents where they are
  /// displaced. External agents go straight on between. False: no such agent, or a value is not
  /// finite (nothing changed).
  [[nodiscard]] bool set_state(AgentId id, const AgentState& state);
  [[nodiscard]] bool set_traits(AgentId id, const AgentTraits& traits);
  [[nodiscard]] bool set_role(AgentId id, Role role);
  std::optional<Agent> find(AgentId id) const;
  std::optional<int> group_of(AgentId id) const;

  /// Replaces all. @throws ConfigError if they are too large
  void set_obstacles(std::span<const Pillar> pillars, std::span<const Wall> walls);

  /// Phase of a rhythm, such as music, that leads the group instead of its first agent, now; kept
  /// until set again.
  void set_beat(int group, std::optional<double> phase_rad);

  /// From t to t + dt. @param team  threads, or nullptr
  void step(parallel::Team* team = nullptr);
  double time_s() const;
  double dt_s() const;

  /// Rows: all agents, ordered by group and id. Spans are valid until agents join or leave.
  int size() const;
  struct Rows {
    int first, count;
  };
  Rows rows(int group) const;
  std::span<const AgentId> ids() const;
  std::span<const Role> roles() const;
  std::span<const double> x_m() const;
  std::span<const double> y_m() const;
  std::span<const float> velocity_x_m_s() const;
  std::span<const float> velocity_y_m_s() const;
  std::span<const double> heading_rad() const;
  std::span<const double> phase_rad() const;         ///< not wrapped
  std::span<const double> phase_rate_rad_s() const;  ///< NaN before the first step
  std::span<const float> length() const;             ///< μ
  Agent agent(int row) const;

  /// Output of the rules for an agent in the last step: for an external one, its command.
  struct Wish {
    double phase_rate_rad_s, length, heading_rate_rad_s;  ///< φ̇, μ, ψ̇
  };
  /// Empty before the first step with it.
  std::optional<Wish> wish(AgentId id) const;

  /// Addend of ψ̇ by navigation in the last step, before it was shared with the goal; NaN: not
  /// known, as before the first step and after an agent came or left. 0 in groups that do not
  /// avoid.
  double avoidance_rad_s(int row) const;

  /// zᵢ − dᵢ of all rows of a group [m], into as many values.
  void spacing(int group, std::span<double> error_m) const;

  /// Contacts in the last step within groups that avoid.
  struct Contacts {
    int held = 0;         ///< agents whose velocity was bounded by others or obstacles
    int overlapping = 0;  ///< agents in another's disc, or in an obstacle, at the step's begin
    /// between discs, and to obstacles; where more than 0.1 m, of those that bound somebody
    double least_gap_m = std::numeric_limits<double>::infinity();
  };
  Contacts contacts() const;

  /// Memory of all arrays, per agent, without obstacles.
  double bytes_per_agent() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mimesis::crowd
