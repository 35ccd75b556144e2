#include "nodes/crowd/engine/crowd.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/error.h"
#include "nodes/crowd/engine/crowd_impl.h"

namespace mimesis::crowd {
namespace {

/// Bound of the largest eigenvalue of the Laplacian [M18 A.2; Gershgorin].
double largest_eigenvalue(const GraphSettings& graph, double n) {
  switch (graph.topology) {
    case Topology::none:
      return 0.0;
    case Topology::chain:
    case Topology::ring:
      return 4.0;
    case Topology::weighted:
      break;
    default:
      return n;
  }
  int nodes = 0;
  for (const Edge& e : graph.edges) nodes = std::max({nodes, e.i + 1, e.j + 1});
  double most = 0.0;
  std::vector<double> degree(static_cast<std::size_t>(nodes), 0.0);
  for (const Edge& e : graph.edges) {
    most = std::max(most, degree[static_cast<std::size_t>(e.i)] += e.weight);
    if (graph.directed) continue;
    most = std::max(most, degree[static_cast<std::size_t>(e.j)] += e.weight);
  }
  return 2.0 * most;
}

/// Refuses edges that are none.
void check_edges(const Rules& r) {
  for (const GraphSettings* graph :
       {&r.frequency.graph, &r.length.graph, &r.phase.graph, &r.heading.graph}) {
    if (graph->topology != Topology::weighted) continue;
    int nodes = 0;
    for (const Edge& e : graph->edges) nodes = std::max({nodes, e.i + 1, e.j + 1});
    (void)CouplingGraph::weighted(nodes, graph->edges, graph->directed);
  }
}

/// Checks that steps of dt follow the fastest error of n coupled agents. Up to here each step of
/// Adams and Bashforth's takes a fifth of it at least; near 1/dt they take nothing, beyond it
/// grows.
void check_stiffness(const GroupSettings& s, double dt, double n, double omega,
                     const std::string& what) {
  const Rules& r = s.rules;
  const double phase =
      r.phase.gain_1_s * largest_eigenvalue(r.phase.graph, n) + r.phase.leader_gain_1_s +
      std::abs(r.frequency.gain_rad_m_s) * s.gait.most() * largest_eigenvalue(r.frequency.graph, n);
  const double length =
      r.length.gain_1_m * omega * s.gait.most() * largest_eigenvalue(r.length.graph, n);
  const HeadingRule& h = r.heading;
  double heading = h.kind == HeadingKind::keep ? 0.0 : std::abs(h.gain);
  if (h.kind == HeadingKind::coupled) heading *= largest_eigenvalue(h.graph, n);
  if (h.kind == HeadingKind::lane || h.kind == HeadingKind::consensus) heading *= omega;
  constexpr double kMost = 0.55;
  for (const auto& [rate, rule] :
       {std::pair(phase, "rules I and III"), {length, "rule II"}, {heading, "rule IV"}}) {
    if (rate * dt >= kMost) {
      throw ConfigError(what + rule + ": with " + std::to_string(static_cast<long>(n)) +
                        " agents the fastest error decays at " + std::to_string(rate) +
                        " 1/s, which steps of " + std::to_string(dt) +
                        " s do not follow; expected below " + std::to_string(kMost / dt) + " 1/s");
    }
  }
}

/// Checks that edges are between n nodes.
void check_edges(const GraphSettings& graph, int n, const std::string& what) {
  for (const Edge& e : graph.edges) {
    if (std::min(e.i, e.j) >= 0 && std::max(e.i, e.j) < n) continue;
    throw ConfigError(what + "edge " + std::to_string(e.i) + " - " + std::to_string(e.j) +
                      ": the graph has nodes 0 to " + std::to_string(n - 1));
  }
}

bool is_finite(const AgentState& s) {
  const auto may_miss = [](double x) { return !std::isinf(x); };
  return s.position_W_m.allFinite() && s.velocity_W_m_s.allFinite() &&
         std::isfinite(s.heading_rad) && std::isfinite(s.phase_rad) && std::isfinite(s.length) &&
         std::isfinite(s.smoothed_error_m) && may_miss(s.phase_rate_rad_s) &&
         may_miss(s.heading_rate_rad_s);
}

/// Why traits are refused, or nothing.
std::string flaw_of(const AgentTraits& t) {
  const auto above = [](double x) { return std::isfinite(x) && x > 0.0; };
  if (!std::isfinite(t.omega_rad_s) || t.omega_rad_s < 0.0) {
    return "eigenfrequency: expected a finite number, not negative";
  }
  if (!above(t.stride)) return "stride: expected a finite number above 0";
  if (!std::isfinite(t.radius_m) || t.radius_m < 0.0) return "radius: expected not negative";
  if (!std::isfinite(t.place_m) || !std::isfinite(t.lane_m) || !t.goal_W_m.allFinite()) {
    return "place, lane and goal: expected finite numbers";
  }
  return {};
}

std::string name_of(int group) { return "crowd: group " + std::to_string(group) + ", "; }

double fastest(const AgentTable& t, int first, int count) {
  const auto begin = t.omega.begin() + first;
  return count > 0 ? *std::max_element(begin, begin + count) : 0.0;
}

}  // namespace

Crowd::Crowd(const CrowdSettings& settings) : impl_(std::make_unique<Impl>(settings)) {}
Crowd::~Crowd() = default;
Crowd::Crowd(Crowd&&) noexcept = default;
Crowd& Crowd::operator=(Crowd&&) noexcept = default;

int Crowd::Impl::find_row(AgentId id) const {
  for (const GroupRows& g : groups) {
    const auto begin = table.id.begin() + g.first, end = begin + g.count;
    const auto at = std::lower_bound(begin, end, id);
    if (at != end && *at == id) return static_cast<int>(at - table.id.begin());
  }
  return -1;
}

GroupRows& Crowd::Impl::group_at(int row) {
  return *std::ranges::find_if(
      groups, [&](const GroupRows& g) { return row >= g.first && row < g.first + g.count; });
}

int Crowd::add_group(const GroupSettings& settings) {
  const int number = groups();
  check_edges(settings.rules);
  GroupRows g{settings};
  g.first = size();
  impl_->groups.push_back(std::move(g));
  return number;
}

double Crowd::Impl::coupled_agents(const GroupRows& g, std::span<const Agent> more) const {
  double coupled = 0.0;
  const auto count = [&](Role role) { coupled += is_coupled(role) ? 1.0 : 0.0; };
  for (int row = g.first; row < g.first + g.count; ++row) {
    count(table.role[static_cast<std::size_t>(row)]);
  }
  for (const Agent& agent : more) count(agent.role);
  return coupled;
}

void Crowd::set_rules(int group, const Rules& rules) {
  GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  check_edges(rules);
  const GroupSettings next{rules, g.settings.gait, g.settings.path, g.settings.sway};
  check_stiffness(next, dt_s(), impl_->coupled_agents(g), fastest(impl_->table, g.first, g.count),
                  name_of(group));
  impl_->prepare(g);  // edges are between the members of now
  GroupRows changed = g;
  changed.settings = next;
  changed.changed = true;
  const bool follow = rules.phase.leader_gain_1_s > 0.0 && !changed.beat_rad;
  const int n = static_cast<int>(g.members.size());
  for (const GraphSettings* graph :
       {&rules.frequency.graph, &rules.length.graph, &rules.heading.graph, &rules.phase.graph}) {
    if (n > 0)
      check_edges(*graph, graph == &rules.phase.graph && follow ? n - 1 : n, name_of(group));
  }
  g = std::move(changed);
  g.lift = true;
}

void Crowd::set_gait(int group, const SpeedFunction& gait, const HeadingSway& sway) {
  GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  const GroupSettings next{g.settings.rules, gait, g.settings.path, sway};
  check_stiffness(next, dt_s(), impl_->coupled_agents(g), fastest(impl_->table, g.first, g.count),
                  name_of(group));
  g.settings = next;
}

const GroupSettings& Crowd::group(int group) const {
  return impl_->groups.at(static_cast<std::size_t>(group)).settings;
}

int Crowd::groups() const { return static_cast<int>(impl_->groups.size()); }

void Crowd::add(int group, std::span<const Agent> agents) {
  GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  AgentTable& table = impl_->table;
  std::vector<Agent> sorted(agents.begin(), agents.end());
  std::ranges::sort(sorted, {}, &Agent::id);
  double omega = fastest(table, g.first, g.count);
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const std::string who = "crowd: agent " + std::to_string(sorted[i].id);
    if (sorted[i].id == 0) throw ConfigError("crowd: ids of agents are from 1");
    const bool twice = i > 0 && sorted[i - 1].id == sorted[i].id;
    if (twice || impl_->find_row(sorted[i].id) >= 0) throw ConfigError(who + " is there already");
    if (!is_finite(sorted[i].state)) throw ConfigError(who + ", state: expected finite numbers");
    const std::string flaw = flaw_of(sorted[i].traits);
    if (!flaw.empty()) throw ConfigError(who + ", " + flaw);
    omega = std::max(omega, sorted[i].traits.omega_rad_s);
  }
  check_stiffness(g.settings, dt_s(), impl_->coupled_agents(g, sorted), omega, name_of(group));
  if (sorted.empty()) return;
  table.merge(g.first, g.count, sorted);
  const int more = static_cast<int>(sorted.size());
  g.count += more;
  g.changed = g.lift = true;
  for (auto after = static_cast<std::size_t>(group) + 1; after < impl_->groups.size(); ++after) {
    impl_->groups[after].first += more;
    impl_->groups[after].changed = true;
  }
}

int Crowd::remove(std::span<const AgentId> ids) {
  std::vector<int> rows;
  for (const AgentId id : ids) {
    if (const int row = impl_->find_row(id); row >= 0) rows.push_back(row);
  }
  std::ranges::sort(rows);
  rows.erase(std::unique(rows.begin(), rows.end()), rows.end());
  for (auto row = rows.rbegin(); row != rows.rend(); ++row) {
    GroupRows& g = impl_->group_at(*row);
    --g.count;
    for (GroupRows& other : impl_->groups) other.changed = true;
    for (GroupRows* other = &g + 1; other <= &impl_->groups.back(); ++other) --other->first;
  }
  impl_->table.erase(rows);
  return static_cast<int>(rows.size());
}

bool Crowd::set_state(AgentId id, const AgentState& state) {
  const int row = impl_->find_row(id);
  if (row < 0 || !is_finite(state)) return false;
  AgentState lifted = state;
  lifted.phase_rad =
      nearest_turn(state.phase_rad, impl_->table.phase[static_cast<std::size_t>(row)]);
  impl_->table.set_state(row, lifted);
  impl_->group_at(row).summed = false;
  return true;
}

bool Crowd::set_traits(AgentId id, const AgentTraits& traits) {
  const int row = impl_->find_row(id);
  if (row < 0 || !flaw_of(traits).empty()) return false;
  impl_->table.set_traits(row, traits);
  impl_->group_at(row).summed = false;
  return true;
}

bool Crowd::set_role(AgentId id, Role role) {
  const int row = impl_->find_row(id);
  if (row < 0) return false;
  impl_->table.role[static_cast<std::size_t>(row)] = role;
  impl_->group_at(row).changed = true;
  return true;
}

std::optional<Agent> Crowd::find(AgentId id) const {
  const int row = impl_->find_row(id);
  if (row < 0) return std::nullopt;
  return impl_->table.get(row);
}

std::optional<int> Crowd::group_of(AgentId id) const {
  const int row = impl_->find_row(id);
  if (row < 0) return std::nullopt;
  return static_cast<int>(&impl_->group_at(row) - impl_->groups.data());
}

void Crowd::set_obstacles(std::span<const Pillar> pillars, std::span<const Wall> walls) {
  impl_->obstacles = ObstacleGrid(pillars, walls, impl_->settings.avoid.reach_m);
}

void Crowd::set_beat(int group, std::optional<double> phase_rad) {
  GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  // The first agent follows, or leads, from now on.
  g.changed = g.changed || phase_rad.has_value() != g.beat_rad.has_value();
  g.beat_rad = phase_rad;
}

double Crowd::time_s() const { return static_cast<double>(impl_->steps) * dt_s(); }
double Crowd::dt_s() const { return impl_->settings.dt_s; }

int Crowd::size() const { return impl_->table.size(); }
Crowd::Rows Crowd::rows(int group) const {
  const GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  return {g.first, g.count};
}
std::span<const AgentId> Crowd::ids() const { return impl_->table.id; }
std::span<const Role> Crowd::roles() const { return impl_->table.role; }
std::span<const double> Crowd::x_m() const { return impl_->table.x; }
std::span<const double> Crowd::y_m() const { return impl_->table.y; }
std::span<const float> Crowd::velocity_x_m_s() const { return impl_->table.vx; }
std::span<const float> Crowd::velocity_y_m_s() const { return impl_->table.vy; }
std::span<const double> Crowd::heading_rad() const { return impl_->table.heading; }
std::span<const double> Crowd::phase_rad() const { return impl_->table.phase; }
std::span<const double> Crowd::phase_rate_rad_s() const { return impl_->table.phase_rate; }
std::span<const float> Crowd::length() const { return impl_->table.length; }
Agent Crowd::agent(int row) const { return impl_->table.get(row); }

Crowd::Contacts Crowd::contacts() const { return impl_->contacts; }

GroupSums operator+(const GroupSums& a, const GroupSums& b) {
  return {a.count + b.count,     a.cos_phase + b.cos_phase,     a.sin_phase + b.sin_phase,
          a.error_m + b.error_m, a.cos_heading + b.cos_heading, a.sin_heading + b.sin_heading};
}

std::size_t AgentTable::bytes_per_row() const {
  std::size_t bytes = 0;
  for_each_column(const_cast<AgentTable&>(*this),
                  [&](auto& column) { bytes += sizeof(column[0]); });
  return bytes;
}

Agent AgentTable::get(int row) const {
  const auto i = static_cast<std::size_t>(row);
  Agent a{id[i], role[i], {}, {}};
  a.state = {{x[i], y[i]},  {vx[i], vy[i]},  heading[i],  phase[i],   length[i],
             phase_rate[i], heading_rate[i], smoothed[i], pressed[i], held[i]};
  a.traits = {omega[i], stride[i], radius[i], place[i], lane[i], {goal_x[i], goal_y[i]}};
  return a;
}

void AgentTable::set(int row, const Agent& agent) {
  const auto i = static_cast<std::size_t>(row);
  id[i] = agent.id;
  role[i] = agent.role;
  set_state(row, agent.state);
  set_traits(row, agent.traits);
}

void AgentTable::set_state(int row, const AgentState& s) {
  const auto i = static_cast<std::size_t>(row);
  x[i] = s.position_W_m.x();
  y[i] = s.position_W_m.y();
  vx[i] = static_cast<float>(s.velocity_W_m_s.x());
  vy[i] = static_cast<float>(s.velocity_W_m_s.y());
  heading[i] = s.heading_rad;
  phase[i] = s.phase_rad;
  length[i] = static_cast<float>(s.length);
  phase_rate[i] = s.phase_rate_rad_s;
  heading_rate[i] = s.heading_rate_rad_s;
  pressed[i] = static_cast<std::uint8_t>(std::clamp(s.pressed, 0, AgentState::kMostPressed));
  smoothed[i] = s.smoothed_error_m;
  held[i] = static_cast<float>(s.held_s);
}

void AgentTable::set_traits(int row, const AgentTraits& t) {
  const auto i = static_cast<std::size_t>(row);
  omega[i] = t.omega_rad_s;
  stride[i] = static_cast<float>(t.stride);
  radius[i] = static_cast<float>(t.radius_m);
  place[i] = t.place_m;
  lane[i] = t.lane_m;
  goal_x[i] = t.goal_W_m.x();
  goal_y[i] = t.goal_W_m.y();
}

void AgentTable::merge(int first, int count, std::span<const Agent> sorted) {
  const int more = static_cast<int>(sorted.size()), n = size();
  const auto wide = static_cast<std::size_t>(n + more);
  for_each_column(*this, [&](auto& column) {
    column.resize(wide);
    const auto end = column.begin() + first + count;
    std::copy_backward(end, column.begin() + n, column.end());
  });
  // From the back, so that no row is overwritten before it has moved.
  int old = first + count - 1, fresh = more - 1;
  for (int to = first + count + more - 1; fresh >= 0; --to) {
    const auto t = static_cast<std::size_t>(to);
    if (old >= first &&
        id[static_cast<std::size_t>(old)] > sorted[static_cast<std::size_t>(fresh)].id) {
      for_each_column(*this, [&](auto& c) { c[t] = c[static_cast<std::size_t>(old)]; });
      --old;
    } else {
      set(to, sorted[static_cast<std::size_t>(fresh--)]);
    }
  }
}

void AgentTable::erase(std::span<const int> rows) {
  if (rows.empty()) return;
  for_each_column(*this, [&](auto& column) {
    auto to = static_cast<std::size_t>(rows[0]);
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const auto from = static_cast<std::size_t>(rows[k]) + 1;
      const auto end = k + 1 < rows.size() ? static_cast<std::size_t>(rows[k + 1]) : column.size();
      for (std::size_t i = from; i < end; ++i) column[to++] = column[i];
    }
    column.resize(to);
  });
}

}  // namespace mimesis::crowd
