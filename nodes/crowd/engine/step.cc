#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

#include "common/math/circle.h"
#include "common/math/vector_clones.h"
#include "common/parallel/team.h"
#include "nodes/crowd/engine/crowd_impl.h"
#include "nodes/crowd/engine/walk_rows.h"
#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {

namespace {

/// Edges between the nodes of before, named by id, as edges between the nodes of now.
void renumber(GraphSettings& graph, std::span<const AgentId> before, std::span<const AgentId> now) {
  if (graph.topology != Topology::weighted) return;
  std::vector<Edge> kept;
  const auto node = [&](int i) {
    if (i >= static_cast<int>(before.size())) return -1;
    const auto at = std::ranges::lower_bound(now, before[static_cast<std::size_t>(i)]);
    const bool there = at != now.end() && *at == before[static_cast<std::size_t>(i)];
    return there ? static_cast<int>(at - now.begin()) : -1;
  };
  for (const Edge& e : graph.edges) {
    const Edge moved{node(e.i), node(e.j), e.weight};
    if (moved.i >= 0 && moved.j >= 0) kept.push_back(moved);
  }
  graph.edges = std::move(kept);
}

/// A wheel of fewer than four is all-to-all, as it is of four.
CouplingGraph make_graph(const GraphSettings& settings, int n) {
  if (settings.topology == Topology::weighted)
    return CouplingGraph::weighted(n, settings.edges, settings.directed);
  const bool small = settings.topology == Topology::wheel && n < 4;
  return CouplingGraph::make(small ? Topology::all_to_all : settings.topology, n);
}

bool is_sparse(const CouplingGraph& graph) {
  return graph.topology() != Topology::none && !graph.complete();
}

std::span<double> first_of(std::vector<double>& values, int n) {
  return {values.data(), static_cast<std::size_t>(n)};
}

}  // namespace

void WalkField::set_gait(const SpeedFunction& gait, const HeadingSway& of_heading) {
  mean_g = gait.mean();
  std::copy_n(gait.cosine().begin(), cosine.size(), cosine.begin());
  std::copy_n(gait.sine().begin(), sine.size(), sine.begin());
  sway = of_heading;
  sways = !sway.none();
}

MIMESIS_VECTOR_CLONES
GroupSums walk_sums(const WalkField& field, const AgentTable& table, int first, int last) {
  return rows::sum_rows(field, table, first, last);
}

MIMESIS_VECTOR_CLONES
GroupSums walk(const WalkField& field, AgentTable& table, int first, int last) {
  return rows::walk_rows(field, table, first, last);
}

void Crowd::Impl::resize_scratch() {
  const auto n = static_cast<std::size_t>(table.size());
  for (auto* column : {&pull, &frequency_error, &length_error, &turn, &nodes_a, &nodes_b,
                       &nodes_out, &wished_rate, &wished_length, &wished_turn}) {
    column->resize(n);
  }
  parts.resize(n / kChunk + 1 + groups.size());
  fields.resize(groups.size());
  if (!avoiding) return;
  wish_x.resize(n);
  wish_y.resize(n);
  avoids.resize(n);
  seeks.resize(n);
  for (const GroupRows& g : groups) {
    const HeadingRule& heading = g.settings.rules.heading;
    std::fill_n(avoids.begin() + g.first, g.count, heading.avoid ? 1 : 0);
    std::fill_n(seeks.begin() + g.first, g.count, heading.kind == HeadingKind::goal ? 1 : 0);
  }
}

void Crowd::Impl::prepare(GroupRows& g) {
  if (!g.changed) return;
  g.changed = false;
  g.summed = false;
  if (std::exchange(g.lift, false)) {
    lift_phases(std::span(table.phase)
                    .subspan(static_cast<std::size_t>(g.first), static_cast<std::size_t>(g.count)));
  }
  g.members.clear();
  g.mixed = false;
  g.leader_row = -1;
  for (int row = g.first; row < g.first + g.count; ++row) {
    const Role role = table.role[static_cast<std::size_t>(row)];
    g.mixed = g.mixed || role != Role::own;
    if (!is_coupled(role)) continue;
    if (g.leader_row < 0) g.leader_row = row;
    g.members.push_back(row);
  }
  std::vector<AgentId> names(g.members.size());
  std::ranges::transform(g.members, names.begin(),
                         [&](int row) { return table.id[static_cast<std::size_t>(row)]; });
  Rules& rules = g.settings.rules;
  const bool led = rules.phase.leader_gain_1_s > 0.0;
  if (!g.names.empty()) {
    const std::span before(g.names), now(names);
    renumber(rules.frequency.graph, before, now);
    renumber(rules.length.graph, before, now);
    renumber(rules.heading.graph, before, now);
    const std::size_t skip = led ? 1 : 0;
    renumber(rules.phase.graph, before.subspan(std::min(skip, before.size())),
             now.subspan(std::min(skip, now.size())));
  }
  g.names = std::move(names);
  g.followers = g.members;  // all of them, where a rhythm leads
  if (led && !g.followers.empty() && !g.beat_rad) g.followers.erase(g.followers.begin());
  const int n = static_cast<int>(g.members.size());
  g.frequency = make_graph(rules.frequency.graph, n);
  g.length = make_graph(rules.length.graph, n);
  g.heading = make_graph(rules.heading.graph, n);
  g.phase = make_graph(rules.phase.graph, static_cast<int>(g.followers.size()));
}

GroupSums Crowd::Impl::sums_of(GroupRows& g) {
  if (!g.summed) {
    WalkField f;
    f.origin_x = g.settings.path.origin_W_m.x();
    f.origin_y = g.settings.path.origin_W_m.y();
    f.along_x = std::cos(g.settings.path.direction_rad);
    f.along_y = std::sin(g.settings.path.direction_rad);
    f.mixed = g.mixed;
    g.sums = {};
    for (int row = g.first; row < g.first + g.count; row += kChunk) {
      g.sums = g.sums + walk_sums(f, table, row, std::min(row + kChunk, g.first + g.count));
    }
    g.summed = true;
  }
  return g.sums;
}

void Crowd::Impl::couple_phases(const GroupRows& g, const GroupSums& total, WalkField& f) {
  const PhaseRule& rule = g.settings.rules.phase;
  const bool led = rule.leader_gain_1_s > 0.0 && (g.beat_rad || g.leader_row >= 0);
  const bool by_agent = led && !g.beat_rad;
  Leader leader{
      led ? rule.leader_gain_1_s : 0.0,
      by_agent ? table.phase[static_cast<std::size_t>(g.leader_row)] : g.beat_rad.value_or(0.0)};
  if (!is_sparse(g.phase)) {
    CircularSum sum{total.cos_phase, total.sin_phase, total.count};
    if (by_agent) {
      sum.cos -= std::cos(leader.phi_rad);
      sum.sin -= std::sin(leader.phi_rad);
      sum.count -= 1.0;
    }
    const bool all = g.phase.complete();
    f.pull_to = mean_field_pull(sum, all ? rule.gain_1_s : 0.0, leader);
    f.leader_row = by_agent ? g.leader_row : -1;
    return;
  }
  const int n = static_cast<int>(g.followers.size());
  double mean = 0.0;
  for (int k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    nodes_a[i] = table.phase[static_cast<std::size_t>(g.followers[i])];
    mean += nodes_a[i] / n;
    nodes_out[i] = 0.0;
  }
  leader.phi_rad = nearest_turn(leader.phi_rad, mean);
  add_phase_coupling(g.phase, rule.gain_1_s, first_of(nodes_a, n), leader, first_of(nodes_out, n));
  std::fill_n(pull.begin() + g.first, g.count, 0.0);
  for (int k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    pull[static_cast<std::size_t>(g.followers[i])] = nodes_out[i];
  }
  f.pull = pull.data();
}

void Crowd::Impl::couple_spacing(const GroupRows& g, const CouplingGraph& graph,
                                 std::vector<double>& error) {
  const int n = static_cast<int>(g.members.size());
  const Path& path = g.settings.path;
  const Eigen::Vector2d along(std::cos(path.direction_rad), std::sin(path.direction_rad));
  for (int k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k), row = static_cast<std::size_t>(g.members[i]);
    nodes_a[i] = (Eigen::Vector2d(table.x[row], table.y[row]) - path.origin_W_m).dot(along);
    nodes_b[i] = table.place[row];
  }
  spacing_errors(graph, first_of(nodes_a, n), first_of(nodes_b, n), first_of(nodes_out, n));
  std::fill_n(error.begin() + g.first, g.count, 0.0);
  for (int k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    error[static_cast<std::size_t>(g.members[i])] = nodes_out[i];
  }
}

void Crowd::Impl::couple_headings(GroupRows& g, const GroupSums& total, WalkField& f) {
  const HeadingRule& rule = g.settings.rules.heading;
  if (rule.kind == HeadingKind::consensus) {
    const double mean = std::atan2(total.sin_heading, total.cos_heading);
    const bool smooth = rule.low_pass_s > 0.0 && g.has_chi;
    // τ χ̇ = arg Σ e^{iψ} − χ on the circle [M18 4.4.2]
    const double share = smooth ? low_pass_share(f.dt / rule.low_pass_s) : 1.0;
    g.chi_rad += share * math::wrap_pi(mean - g.chi_rad);
    g.has_chi = true;
    f.mean_heading = {std::cos(g.chi_rad), std::sin(g.chi_rad)};
    return;
  }
  if (rule.kind != HeadingKind::coupled) return;
  if (g.heading.complete() && rule.spread_rad == 0.0) {
    f.mean_heading = {total.cos_heading, total.sin_heading};
    return;
  }
  const int n = static_cast<int>(g.members.size());
  for (int k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    nodes_a[i] = table.heading[static_cast<std::size_t>(g.members[i])];
    nodes_out[i] = 0.0;
  }
  add_heading_coupling(g.heading, rule, first_of(nodes_a, n), first_of(nodes_out, n));
  std::fill_n(turn.begin() + g.first, g.count, 0.0);
  for (int k = 0; k < n; ++k) {
    const auto i = static_cast<std::size_t>(k);
    turn[static_cast<std::size_t>(g.members[i])] = nodes_out[i];
  }
  f.turn = turn.data();
}

WalkField Crowd::Impl::field(GroupRows& g) {
  const GroupSums total = sums_of(g);
  const Rules& r = g.settings.rules;
  WalkField f;
  f.dt = settings.dt_s;
  f.set_gait(g.settings.gait, g.settings.sway);
  f.origin_x = g.settings.path.origin_W_m.x();
  f.origin_y = g.settings.path.origin_W_m.y();
  f.path_rad = g.settings.path.direction_rad;
  f.along_x = std::cos(f.path_rad);
  f.along_y = std::sin(f.path_rad);
  f.count = total.count;
  f.error_sum = total.error_m;
  f.saturation = r.frequency.saturation_m;
  f.low_pass =
      r.frequency.low_pass_rad_s > 0.0 ? low_pass_share(r.frequency.low_pass_rad_s * f.dt) : 0.0;
  f.length_limit = r.length.limit;
  if (g.frequency.topology() != Topology::none) f.frequency_gain = r.frequency.gain_rad_m_s;
  if (g.length.topology() != Topology::none) f.length_gain = r.length.gain_1_m;
  couple_phases(g, total, f);
  if (f.frequency_gain != 0.0 && !g.frequency.complete()) {
    couple_spacing(g, g.frequency, frequency_error);
    f.frequency_error = frequency_error.data();
  }
  if (f.length_gain != 0.0 && !g.length.complete()) {
    couple_spacing(g, g.length, length_error);
    f.length_error = length_error.data();
  }
  f.heading = r.heading.kind;
  f.heading_gain = r.heading.gain;
  f.ahead = r.heading.ahead_m;
  f.arrive = settings.avoid.arrive_m;
  f.per_patience = 1.0 / kPatience_s;
  couple_headings(g, total, f);
  if (r.heading.avoid) {
    if (f.turn == nullptr) std::fill_n(turn.begin() + g.first, g.count, 0.0);
    f.turn = turn.data();
    // coupled headings share the column, and are guaranteed as they are
    if (f.heading != HeadingKind::coupled) {
      f.per_width = f.dt / settings.avoid.navigation.sigma_angle_rad;
    }
    f.wish_x = wish_x.data();
    f.wish_y = wish_y.data();
  }
  f.mixed = g.mixed;
  f.wished_rate = wished_rate.data();
  f.wished_length = wished_length.data();
  f.wished_turn = wished_turn.data();
  return f;
}

void Crowd::Impl::walk_group(GroupRows& g, const WalkField& f, parallel::Team* team) {
  const int chunks = (g.count + kChunk - 1) / kChunk;
  const auto walk_chunk = [&](int c) {
    const int first = g.first + c * kChunk;
    parts[static_cast<std::size_t>(c)] =
        walk(f, table, first, std::min(first + kChunk, g.first + g.count));
  };
  parallel::for_each(team, chunks, walk_chunk);
  g.sums = {};
  for (int c = 0; c < chunks; ++c) g.sums = g.sums + parts[static_cast<std::size_t>(c)];
  g.summed = f.wish_x == nullptr;
}

void Crowd::step(parallel::Team* team) {
  Impl& c = *impl_;
  c.avoiding = std::ranges::any_of(
      c.groups, [](const GroupRows& g) { return g.settings.rules.heading.avoid && g.count > 0; });
  c.resize_scratch();
  for (GroupRows& g : c.groups) c.prepare(g);
  for (std::size_t k = 0; k < c.groups.size(); ++k) c.fields[k] = c.field(c.groups[k]);
  if (c.avoiding) c.steer_all(team);
  for (std::size_t k = 0; k < c.groups.size(); ++k) c.walk_group(c.groups[k], c.fields[k], team);
  c.contacts = {};
  if (c.avoiding) c.part_all(team);
  ++c.steps;
}

std::optional<Crowd::Wish> Crowd::wish(AgentId id) const {
  const int row = impl_->find_row(id);
  const auto i = static_cast<std::size_t>(row);
  if (row < 0 || i >= impl_->wished_rate.size() || impl_->group_at(row).changed)
    return std::nullopt;
  return Wish{impl_->wished_rate[i], impl_->wished_length[i], impl_->wished_turn[i]};
}

double Crowd::avoidance_rad_s(int row) const {
  const auto i = static_cast<std::size_t>(row);
  const GroupRows& g = impl_->group_at(row);
  if (g.changed || i >= impl_->turn.size()) return std::numeric_limits<double>::quiet_NaN();
  const HeadingRule& rule = g.settings.rules.heading;
  if (!rule.avoid) return 0.0;
  // The column also holds the sum of coupled headings.
  if (rule.kind == HeadingKind::coupled) return std::numeric_limits<double>::quiet_NaN();
  return impl_->turn[i];
}

void Crowd::spacing(int group, std::span<double> error_m) const {
  const GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  const Path& path = g.settings.path;
  const Eigen::Vector2d along(std::cos(path.direction_rad), std::sin(path.direction_rad));
  for (std::size_t k = 0; k < error_m.size() && k < static_cast<std::size_t>(g.count); ++k) {
    const auto row = static_cast<std::size_t>(g.first) + k;
    const Eigen::Vector2d p(impl_->table.x[row], impl_->table.y[row]);
    error_m[k] = (p - path.origin_W_m).dot(along) - impl_->table.place[row];
  }
}

double Crowd::bytes_per_agent() const {
  // Columns of rows, scratch memory, and the lists of the groups.
  return static_cast<double>(impl_->table.bytes_per_row() + 12 * sizeof(double) + 2 * sizeof(int) +
                             sizeof(AgentId));
}

}  // namespace mimesis::crowd
