#pragma once
#include <Eigen/Core>
#include <chrono>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

#include "nodes/crowd/regions/ownership.h"
#include "nodes/crowd/run/scenario_run.h"

namespace mimesis::crowd {

/// The plane cut into rectangles along x and y of W, each the region of one coordinator. Region
/// r = column + columns · row, columns towards +x, rows towards +y; the outer ones have no end.
class RegionMap {
 public:
  /// @param cuts_x_m, cuts_y_m  where the plane is cut, ascending; none: one region
  /// @throws ConfigError for cuts that are not ascending or not finite
  RegionMap(std::vector<double> cuts_x_m, std::vector<double> cuts_y_m);

  int count() const;
  /// Region that holds p; a point on a cut belongs to the upper side.
  int of(const Eigen::Vector2d& p_W_m) const;
  /// How far p is outside of a region; 0 inside.
  double outside_m(int region, const Eigen::Vector2d& p_W_m) const;
  /// Region that should move an agent at p that `region` moves: it keeps the agent up to `margin_m`
  /// beyond its border, so that an agent that walks along a cut is not handed to and fro.
  int owner(int region, const Eigen::Vector2d& p_W_m, double margin_m) const;
  /// Coordinator of a region: its own; if that is gone, that of the nearest region
  /// (in columns and rows) that is there, of several the first. Precondition: one is there.
  int heir(int region, const std::vector<bool>& there) const;

 private:
  std::vector<double> cuts_x_, cuts_y_;
};

/// An agent of another coordinator.
struct FarAgent {
  AgentId id = 0;
  int group = 0;
  AgentState state{};
  bool external = false;  ///< neither its coordinator moves it
  bool trusted = true;    ///< false: not coupled
  std::uint32_t epoch = 0;
};

/// Sums over one group of another coordinator, with the rates at which they change.
struct FarSums {
  int group = 0;
  GroupSums sums{};
  double phase_rate_rad_s = 0.0;  ///< Σ φ̇
  double speed_m_s = 0.0;         ///< Σ ż
};

/// Report of a coordinator about one instant.
struct FarReport {
  Time stamp{};
  std::vector<FarAgent> agents{};
  std::vector<FarSums> sums{};
  OwnershipReport ownership{};  ///< empty lists: none, it says nothing about it
};

/// An agent that one coordinator offers to another, in its state of `stamp`.
struct Passing {
  Traveller traveller{};
  Offer offer{};
  Time stamp{};
  Time sent{};
};

/// Sums and rates of a group's agents that a run moves itself.
FarSums own_sums(const ScenarioRun& run, int group);

struct FarSettings {
  int coordinators = 1;
  int own = 0;             ///< number of this one, from 0
  double sight_m = 6.0;    ///< distance within which agents of others are avoided
  double stale_s = 0.5;    ///< OwnershipSettings::stale
  double slack_s = 0.024;  ///< OwnershipSettings::slack
};

/// The agents of other coordinators, as one coordinator's crowd needs them: near ones as ghosts and
/// the rest in sums; all of them, as mirrors, in groups that are coupled along graphs
/// (ScenarioRun::whole). An agent on the way from one coordinator to another counts as far until
/// the new one reports it; one that nobody reports stands where it was last seen. Of the run's
/// agents, those that Ownership says are ours are `own`.
class FarCrowd {
 public:
  /// Mirrors that the run has begun with are ours to refresh.
  FarCrowd(const FarSettings& settings, const ScenarioRun& run);

  /// In every step: `begin_step`, then reports and offers, then `decide`. What of our agents is no
  /// longer ours stays in the run as a mirror.
  void begin_step(ScenarioRun& run, Time now);
  /// @param coordinator from 0. A report older than the last is passed over.
  void hear(int coordinator, FarReport report);
  /// An offer, to us or another. True if the agent is in the run now, which is at `state_time`.
  /// @throws ConfigError if it cannot be: then it is offered again, or taken back by its owner
  bool hear(ScenarioRun& run, const Passing& passing, Time state_time);
  /// A coordinator that the view has left out, and groups of the agents that it had.
  struct Left {
    int coordinator;
    std::vector<int> groups;
  };
  struct Decided {
    std::vector<Left> left;
    int taken = 0;        ///< agents that nobody owned, and our own that nobody took
    std::string trouble;  ///< why one of them cannot be in the run; tried again
  };
  Decided decide(ScenarioRun& run, Time state_time);

  /// Offers an agent to coordinator `to`; nothing if that is not possible now.
  std::optional<Passing> give(ScenarioRun& run, AgentId id, int to, Time now);
  /// Our offers that are to be sent again.
  std::vector<Passing> repeats(Time now);
  OwnershipReport report() const { return ownership_.report(); }

  bool heard(int coordinator, Time now) const;
  /// The crowd has begun for us.
  bool started() const { return ownership_.started(); }
  /// Whether a coordinator, and we ourselves, may own agents.
  bool member(int coordinator) const;
  /// Extrapolates the others' reports to `now`, the time of the run's present state, and adds them
  /// to the run. Returns why a group cannot take them, or empty: it continues without.
  std::string import(ScenarioRun& run, Time now);
  /// All agents of others as of the last import.
  std::span<const FarAgent> agents() const { return agents_; }
  int taken_into_account() const { return static_cast<int>(imported_.size()); }

 private:
  struct Imported {
    int group;
    Role role;
    std::uint64_t round;
  };
  bool ours(const ScenarioRun& run, AgentId id) const;
  void follow(ScenarioRun& run);
  void admit(ScenarioRun& run, const Traveller& traveller);
  Traveller last_seen(const ScenarioRun& run, AgentId id) const;
  void forget_arrived(Time now);
  void import(ScenarioRun& run, const FarAgent& agent);
  void collect(const ScenarioRun& run, Time now);
  void add_sums(const ScenarioRun& run, Time now, std::vector<GroupSums>& sums) const;
  bool near_ours(const Eigen::Vector2d& p_W_m) const;
  void mark_cells(const Crowd& crowd);
  Role role_of(const FarAgent& agent, bool whole) const;

  FarSettings settings_;
  Ownership ownership_;
  Time life_{};  // life in which the run's agents are ours
  View view_;    // of the last decide
  std::vector<FarReport> reports_;
  std::vector<Passing> passing_;
  std::vector<FarAgent> agents_;
  std::unordered_map<AgentId, Imported> imported_;
  std::uint64_t round_ = 0;
  std::vector<std::int64_t> cells_;  // where our agents are, sorted
  std::vector<std::vector<Agent>> joining_;
  std::vector<AgentId> leaving_;
};

}  // namespace mimesis::crowd
