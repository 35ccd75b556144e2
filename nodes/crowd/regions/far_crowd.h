#pragma once
#include <Eigen/Core>
#include <chrono>
#include <span>
#include <string>
#include <unordered_map>
#include <vector>

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
  std::chrono::nanoseconds stamp{};
  double time_s = 0.0;  ///< time of its run; 0: it has not begun
  std::vector<FarAgent> agents{};
  std::vector<FarSums> sums{};
};

/// Sums and rates of a group's agents that a run moves itself.
FarSums own_sums(const ScenarioRun& run, int group);

struct FarSettings {
  int coordinators = 1;
  int own = 0;           ///< number of this one, from 0
  double sight_m = 6.0;  ///< distance within which agents of others are avoided
  double stale_s = 0.5;  ///< a coordinator silent for this long is gone, with its agents
};

/// The agents of other coordinators, as one coordinator's crowd needs them: near ones as ghosts and
/// the rest in sums; all of them, as mirrors, in groups that are coupled along graphs
/// (ScenarioRun::whole). An agent on the way from one coordinator to another counts as far until
/// the new one reports it.
class FarCrowd {
 public:
  using Time = std::chrono::nanoseconds;

  /// Mirrors that the run has begun with are ours to refresh.
  FarCrowd(const FarSettings& settings, const ScenarioRun& run);

  /// @param coordinator from 0. A report older than the last is passed over.
  void hear(int coordinator, FarReport report);
  /// An agent goes to coordinator `to` at `stamp`: no report of that time has it.
  void pass(const Traveller& traveller, int to, Time stamp);
  /// Takes an agent out of the run for coordinator `to`; nothing if the run does not move it.
  std::optional<Traveller> give(ScenarioRun& run, AgentId id, int to, Time stamp);
  /// Brings an agent, whose state is of `stamp`, into the run at `now`.
  void take(ScenarioRun& run, Traveller traveller, Time stamp, Time now);
  bool heard(int coordinator, Time now) const;

  /// Coordinators that fell silent since the last call, and the agents they had, those on the way
  /// to it too: in their last reported state, extrapolated to `now`. The coordinator is forgotten;
  /// external agents do not belong to it.
  struct Orphans {
    int coordinator;
    std::vector<Traveller> agents;
  };
  std::vector<Orphans> take_orphans(const ScenarioRun& run, Time now);
  /// An agent of one that fell silent is ours from now on.
  void adopt(ScenarioRun& run, const Traveller& traveller, Time now);
  /// Our run begins where others are at work: all that it began with is theirs.
  void abandon(ScenarioRun& run);

  /// If two coordinators claim an agent, after an interrupted connection, the first one keeps it.
  /// Extrapolates the others' reports to `now`, the time of the run's present state, and adds them
  /// to the run. Returns why a group cannot take them, or empty: it continues without.
  std::string import(ScenarioRun& run, Time now);
  /// All agents of others as of the last import.
  std::span<const FarAgent> agents() const { return agents_; }
  int taken_into_account() const { return static_cast<int>(imported_.size()); }

 private:
  struct Passing {
    FarAgent agent;
    int to;
    Time stamp;
    Traveller traveller;
  };
  struct Imported {
    int group;
    Role role;
    std::uint64_t round;
  };
  void forget_arrived(Time now);
  void import(ScenarioRun& run, const FarAgent& agent);
  void collect(const ScenarioRun& run, Time now);
  void add_sums(const ScenarioRun& run, Time now, std::vector<GroupSums>& sums) const;
  bool near_ours(const Eigen::Vector2d& p_W_m) const;
  void mark_cells(const Crowd& crowd);
  Role role_of(const FarAgent& agent, bool whole) const;

  FarSettings settings_;
  std::vector<FarReport> reports_;
  std::vector<bool> ran_;                    // had begun, by number
  std::unordered_map<AgentId, Time> since_;  // agents are ours that were not at the start
  std::vector<AgentId> claimed_;
  std::vector<Passing> passing_;
  std::vector<FarAgent> agents_;
  std::unordered_map<AgentId, Imported> imported_;
  std::uint64_t round_ = 0;
  std::vector<std::int64_t> cells_;  // where our agents are, sorted
  std::vector<std::vector<Agent>> joining_;
  std::vector<AgentId> leaving_;
};

}  // namespace mimesis::crowd
