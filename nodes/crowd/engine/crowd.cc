#include "nodes/crowd/engine/crowd.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "common/error.h"
#include "nodes/crowd/engine/crowd_impl.h"
#include "nodes/crowd/rules/phase.h"

namespace mimesis::crowd {
namespace {

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

void Crowd::set_path(int group, const Path& path) {
  GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  if (!path.origin_W_m.allFinite() || !std::isfinite(path.direction_rad)) {
    throw ConfigError(name_of(group) + "path: expected finite numbers");
  }
  g.settings.path = path;
  g.summed = false;
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
  g.changed = g.changed || sums.leader != g.outside.leader;  // who follows may have changed
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
