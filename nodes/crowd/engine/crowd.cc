#include "nodes/crowd/engine/crowd.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "common/error.h"
#include "nodes/crowd/engine/crowd_impl.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {
namespace {

void need(bool good, const std::string& what, double value, const std::string& expected) {
  if (!good) {
    throw ConfigError(what + ": " + std::to_string(value) + ", expected " + expected);
  }
}

void not_negative(double value, const std::string& what) {
  need(std::isfinite(value) && value >= 0.0, what, value, "a finite number, not negative");
}

void positive(double value, const std::string& what) {
  need(std::isfinite(value) && value > 0.0, what, value, "a finite number above 0");
}

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
    most = std::max({most, degree[static_cast<std::size_t>(e.i)] += e.weight,
                     degree[static_cast<std::size_t>(e.j)] += e.weight});
  }
  return 2.0 * most;
}

void check(const CrowdSettings& s) {
  positive(s.dt_s, "crowd: dt [s]");
  const AvoidSettings& a = s.avoid;
  const NavigationParams& n = a.navigation;
  not_negative(n.avoid_1_s, "crowd: gain of avoidance [1/s]");
  not_negative(n.predict_1_s, "crowd: gain of predicted collisions [1/s]");
  positive(n.sigma_angle_rad, "crowd: sigma of angles [rad]");
  positive(n.sigma_distance_m, "crowd: sigma of distances [m]");
  positive(n.horizon_s, "crowd: horizon of predictions [s]");
  need(std::isfinite(n.keep_right_rad), "crowd: keep right [rad]", n.keep_right_rad, "a number");
  positive(a.reach_m, "crowd: reach [m]");
  need(a.headway_s >= 2.0 * s.dt_s, "crowd: headway [s]", a.headway_s, "at least 2 dt");
  not_negative(a.separate_m_s, "crowd: speed of separation [m/s]");
  positive(a.arrive_m, "crowd: arrival [m]");
}

void check(const Rules& r, const std::string& what) {
  for (const GraphSettings* graph :
       {&r.frequency.graph, &r.length.graph, &r.phase.graph, &r.heading.graph}) {
    if (graph->topology != Topology::weighted) continue;
    int nodes = 0;
    for (const Edge& e : graph->edges) nodes = std::max({nodes, e.i + 1, e.j + 1});
    (void)CouplingGraph::weighted(nodes, graph->edges);  // refuses an unknown id
  }
  need(std::isfinite(r.frequency.gain_rad_m_s), what + "rule I, gain m_d", r.frequency.gain_rad_m_s,
       "a finite number");
  not_negative(r.frequency.saturation_m, what + "rule I, saturation [m]");
  not_negative(r.frequency.low_pass_rad_s, what + "rule I, low-pass [rad/s]");
  not_negative(r.length.gain_1_m, what + "rule II, gain m_z");
  need(r.length.limit > 0.0 && r.length.limit < 1.0, what + "rule II, limit of the step length",
       r.length.limit, "within (0, 1)");
  not_negative(r.phase.gain_1_s, what + "rule III, gain k");
  not_negative(r.phase.leader_gain_1_s, what + "rule III, gain alpha to the leader");
  not_negative(r.heading.gain, what + "rule IV, gain");
  positive(r.heading.ahead_m, what + "rule IV, distance of the sliding goal [m]");
  not_negative(r.heading.low_pass_s, what + "rule IV, low-pass [s]");
  not_negative(r.heading.spread_rad, what + "rule IV, spread [rad]");
}

/// Checks that steps of dt follow the fastest error of n coupled agents.
void check_stiffness(const GroupSettings& s, double dt, double n, double omega,
                     const std::string& what) {
  const Rules& r = s.rules;
  const double phase =
      r.phase.gain_1_s * largest_eigenvalue(r.phase.graph, n) + r.phase.leader_gain_1_s +
      std::abs(r.frequency.gain_rad_m_s) * s.gait.most() * largest_eigenvalue(r.frequency.graph, n);
  const double length =
      r.length.gain_1_m * omega * s.gait.most() * largest_eigenvalue(r.length.graph, n);
  for (const auto& [rate, rule] : {std::pair(phase, "rules I and III"), {length, "rule II"}}) {
    if (rate * dt >= 1.0) {
      throw ConfigError(what + rule + ": with " + std::to_string(static_cast<long>(n)) +
                        " agents the fastest error decays at " + std::to_string(rate) +
                        " 1/s, which steps of " + std::to_string(dt) +
                        " s do not follow; expected below " + std::to_string(1.0 / dt) + " 1/s");
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

double fastest(const Table& t, int first, int count) {
  const auto begin = t.omega.begin() + first;
  return count > 0 ? *std::max_element(begin, begin + count) : 0.0;
}

}  // namespace

Crowd::Crowd(const CrowdSettings& settings) {
  check(settings);
  impl_ = std::make_unique<Impl>(settings);
}
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
  check(settings.rules, name_of(number));
  GroupRows g{settings};
  g.first = size();
  impl_->groups.push_back(std::move(g));
  return number;
}

void Crowd::set_rules(int group, const Rules& rules) {
  GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  check(rules, name_of(group));
  const GroupSettings next{rules, g.settings.gait, g.settings.path, g.settings.sway};
  check_stiffness(next, dt_s(), g.count + g.outside.count, fastest(impl_->table, g.first, g.count),
                  name_of(group));
  impl_->prepare(g);  // edges are between the members of now
  GroupRows changed = g;
  changed.settings = next;
  changed.changed = true;
  const bool follow = rules.phase.leader_gain_1_s > 0.0 && !impl_->leads_from_outside(changed);
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
  check_stiffness(next, dt_s(), g.count + g.outside.count, fastest(impl_->table, g.first, g.count),
                  name_of(group));
  g.settings = next;
}

const GroupSettings& Crowd::group(int group) const {
  return impl_->groups.at(static_cast<std::size_t>(group)).settings;
}

int Crowd::groups() const { return static_cast<int>(impl_->groups.size()); }

void Crowd::add(int group, std::span<const Agent> agents) {
  GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  Table& table = impl_->table;
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
  check_stiffness(g.settings, dt_s(),
                  g.count + static_cast<double>(sorted.size()) + g.outside.count, omega,
                  name_of(group));
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
  impl_->obstacles = Obstacles(pillars, walls, impl_->settings.avoid.reach_m);
}

void Crowd::set_outside(int group, const GroupSums& sums) {
  GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  g.changed = g.changed || sums.leader != g.outside.leader;  // the followers may have changed
  g.outside = sums;
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

}  // namespace mimesis::crowd
