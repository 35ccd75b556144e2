#pragma once
#include <array>
#include <optional>
#include <vector>

#include "nodes/crowd/engine/agent.h"
#include "nodes/crowd/engine/crowd.h"
#include "nodes/crowd/engine/neighbours.h"
#include "nodes/crowd/rules/coupling_graph.h"
#include "nodes/crowd/rules/gait.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {

/// A walker that is held up for so long looks for a way round, and steers by its goal alone.
inline constexpr double kPatience_s = 1.0;

/// Data that all agents of a group share in one step: rules, path, gait, and the mean fields.
struct WalkField {
  double dt = 0.0;
  // III: all-to-all by pull_to; on other graphs `pull` has the addend of φ̇.
  PhasePull pull_to{};
  int leader_row = -1;  // is not pulled
  const double* pull = nullptr;
  // I and II: all-to-all from count and sum of z − d; on other graphs errors are in the arrays.
  double frequency_gain = 0.0, saturation = 0.0, low_pass = 0.0;  // low_pass: share of low_passed
  double length_gain = 0.0, length_limit = 0.5;
  double count = 0.0, error_sum = 0.0;
  const double* frequency_error = nullptr;
  const double* length_error = nullptr;
  // Path: origin, unit vector along.
  double origin_x = 0.0, origin_y = 0.0, along_x = 1.0, along_y = 0.0, path_rad = 0.0;
  // IV
  HeadingKind heading = HeadingKind::keep;
  double heading_gain = 0.0, ahead = 1.0;
  CosSin mean_heading{0.0, 0.0};  // consensus: e^{iχ}; coupled, all-to-all: Σ e^{iψ}
  double arrive = 0.5, per_patience = 0.0;
  const double* turn = nullptr;  // added to ψ̇: navigation, coupled headings
  double per_width = 0.0;        // dt/σ_φ of navigation, 0: explicit [s/rad]
  // Receives velocities that others may bound before the step is made; else the step is made here.
  double *wish_x = nullptr, *wish_y = nullptr;
  // Rows that are not all our own, and the demands of the rules on every row.
  bool mixed = false;
  double *wished_rate = nullptr, *wished_length = nullptr, *wished_turn = nullptr;
  double mean_g = 0.0;
  std::array<double, SpeedFunction::kHarmonics> cosine{}, sine{};

  bool sways = false;
  HeadingSway sway{};

  void set_gait(const SpeedFunction& gait, const HeadingSway& of_heading);
};

/// Rows [first, last) one step on. All pointers of the field are indexed by row. Returns the sums
/// of the new state over coupled rows, lanes added in a fixed order; with wishes nothing.
GroupSums walk(const WalkField& field, AgentTable& table, int first, int last);
/// The sums without a step.
GroupSums walk_sums(const WalkField& field, const AgentTable& table, int first, int last);

struct GroupRows {
  explicit GroupRows(const GroupSettings& s) : settings(s) {}

  GroupSettings settings;
  int first = 0, count = 0;
  std::optional<double> beat_rad{};  // phase of a rhythm that leads
  // Rebuilt when members or rules change.
  bool changed = true;
  bool lift = true;            // phases are compared for the first time
  bool mixed = false;          // not all are own
  int leader_row = -1;         // the first coupled one
  std::vector<int> members;    // coupled rows, by id
  std::vector<AgentId> names;  // ids of the members: edges of weighted graphs are between them
  std::vector<int> followers;  // those without the leader, for the phases of a sparse graph
  CouplingGraph frequency = CouplingGraph::make(Topology::none, 0), length = frequency,
                phase = frequency, heading = frequency;
  // Sums of the present state, if they are known.
  bool summed = false;
  GroupSums sums{};
  // χ of the consensus.
  bool has_chi = false;
  double chi_rad = 0.0;
};

class Meeting;

struct Crowd::Impl {
  CrowdSettings settings;
  std::vector<GroupRows> groups;
  AgentTable table;
  long steps = 0;
  // Scratch, by row.
  std::vector<double> pull, frequency_error, length_error, turn, nodes_a, nodes_b, nodes_out;
  std::vector<double> wished_rate, wished_length, wished_turn, wish_x, wish_y;
  std::vector<GroupSums> parts;
  std::vector<WalkField> fields;  // by group
  ObstacleGrid obstacles;
  Grid grid;
  bool avoiding = false;               // some group does
  std::vector<std::uint8_t> avoids;    // by row
  std::vector<std::uint8_t> seeks;     // by row: a goal
  std::vector<Contacts> row_contacts;  // by row of the grid
  Contacts contacts{};

  explicit Impl(const CrowdSettings& s) : settings(s) {}

  int find_row(AgentId id) const;
  GroupRows& group_at(int row);

  /// How many agents react to each other in a group, and `more`.
  double coupled_agents(const GroupRows& group, std::span<const Agent> more = {}) const;

  /// Graphs, members, scratch; before a step.
  void prepare(GroupRows& group);
  void resize_scratch();
  GroupSums sums_of(GroupRows& group);
  WalkField field(GroupRows& group);
  void couple_phases(const GroupRows& group, const GroupSums& total, WalkField& field);
  void couple_spacing(const GroupRows& group, const CouplingGraph& graph,
                      std::vector<double>& error);
  void couple_headings(GroupRows& group, const GroupSums& total, WalkField& field);
  /// ψ̇ of navigation, added to `turn` of agents that avoid.
  void steer_all(parallel::Team* team);
  void steer_row(int grid_row);
  /// Velocities within bounds, and the step of agents that avoid.
  void part_all(parallel::Team* team);
  void part_row(int grid_row);
  void part(std::size_t place, Contacts& contacts);
  Eigen::Vector2d parted(std::size_t place, const Eigen::Vector2d& wish, Contacts& contacts,
                         bool& gives_way);
  Meeting met(std::size_t place, const Eigen::Vector2d& wish, double fastest_m_s) const;
  void walk_group(GroupRows& group, const WalkField& field, parallel::Team* team);
};

constexpr int kChunk = 1024;  // rows of one task; fixed, so that sums do not depend on the threads

}  // namespace mimesis::crowd
