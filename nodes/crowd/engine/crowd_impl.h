#pragma once
#include <vector>

#include "nodes/crowd/engine/agent.h"
#include "nodes/crowd/engine/crowd.h"
#include "nodes/crowd/engine/neighbours.h"
#include "nodes/crowd/engine/walk.h"
#include "nodes/crowd/rules/coupling_graph.h"

namespace mimesis::crowd {

struct GroupRows {
  explicit GroupRows(const GroupSettings& s) : settings(s) {}

  GroupSettings settings;
  int first = 0, count = 0;
  GroupSums outside{};
  // Rebuilt when members or rules change.
  bool changed = true;
  bool lift = true;            // phases are compared for the first time
  bool mixed = false;          // not all are own
  int summed_rows = 0;         // own and external
  int leader_row = -1;         // the first of them
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
  Table table;
  long steps = 0;
  // Scratch, by row.
  std::vector<double> pull, frequency_error, length_error, turn, nodes_a, nodes_b, nodes_out;
  std::vector<double> wished_rate, wished_length, wished_turn, wish_x, wish_y;
  std::vector<GroupSums> parts;
  std::vector<WalkField> fields;  // by group
  Obstacles obstacles;
  Grid grid;
  bool avoiding = false;               // some group does
  std::vector<std::uint8_t> avoids;    // by row
  std::vector<Contacts> row_contacts;  // by row of the grid
  Contacts contacts{};

  explicit Impl(const CrowdSettings& s) : settings(s) {}

  int find_row(AgentId id) const;
  GroupRows& group_at(int row);

  /// How many agents react to each other in a group, and `more`. Those of other coordinators are in
  /// the sums from outside, or, along sparse graphs, mirrors here; ghosts are not coupled.
  double coupled_agents(const GroupRows& group, std::span<const Agent> more = {}) const;

  /// Graphs, members, scratch; before a step.
  void prepare(GroupRows& group);
  bool leads_from_outside(const GroupRows& group) const;
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
  Eigen::Vector2d parted(std::size_t place, const Eigen::Vector2d& wish, Contacts& contacts);
  Meeting met(std::size_t place, const Eigen::Vector2d& wish, double fastest_m_s) const;
  void walk_group(GroupRows& group, const WalkField& field, parallel::Team* team);
};

constexpr int kChunk = 1024;  // rows of one task; fixed, so that sums do not depend on the threads

}  // namespace mimesis::crowd
