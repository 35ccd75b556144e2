#include <algorithm>
#include <cmath>

#include "common/parallel/team.h"
#include "nodes/crowd/engine/crowd_impl.h"

namespace mimesis::crowd {

WalkField Crowd::Impl::field(GroupRows& g, parallel::Team* team) {
  const GroupSums total = group_sums(g, sums_of(g, team)) + g.outside;
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
      r.frequency.low_pass_rad_s > 0.0 ? -std::expm1(-r.frequency.low_pass_rad_s * f.dt) : 0.0;
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
  couple_headings(g, total, f);
  if (r.heading.avoid) {
    if (f.turn == nullptr) std::fill_n(turn.begin() + g.first, g.count, 0.0);
    f.turn = turn.data();
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
  for (int c = 0; c < chunks; ++c) g.sums.add(parts[static_cast<std::size_t>(c)]);
  g.summed = f.wish_x == nullptr;
}

void Crowd::step(parallel::Team* team) {
  Impl& c = *impl_;
  c.avoiding = std::ranges::any_of(
      c.groups, [](const GroupRows& g) { return g.settings.rules.heading.avoid && g.count > 0; });
  c.resize_scratch();
  for (GroupRows& g : c.groups) c.prepare(g);
  for (std::size_t k = 0; k < c.groups.size(); ++k) c.fields[k] = c.field(c.groups[k], team);
  if (c.avoiding) c.steer_all(team);
  for (std::size_t k = 0; k < c.groups.size(); ++k) c.walk_group(c.groups[k], c.fields[k], team);
  c.contacts = {};
  if (c.avoiding) c.part_all(team);
  ++c.steps;
}

GroupSums Crowd::sums(int group) const {
  GroupRows& g = impl_->groups.at(static_cast<std::size_t>(group));
  impl_->prepare(g);
  return impl_->group_sums(g, impl_->sums_of(g, nullptr));
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
  // Of coupled headings the sum is in there too.
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
  // Columns of rows, scratch, and what the groups list.
  return static_cast<double>(impl_->table.bytes_per_row() + 12 * sizeof(double) + 2 * sizeof(int) +
                             sizeof(AgentId));
}

}  // namespace mimesis::crowd
