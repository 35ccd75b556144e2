#include "nodes/crowd/engine/table.h"

#include <algorithm>

namespace mimesis::crowd {

GroupSums operator+(const GroupSums& a, const GroupSums& b) {
  const GroupSums& first = a.leader <= b.leader ? a : b;
  return {a.count + b.count,     a.cos_phase + b.cos_phase,     a.sin_phase + b.sin_phase,
          a.error_m + b.error_m, a.cos_heading + b.cos_heading, a.sin_heading + b.sin_heading,
          first.leader,          first.leader_phase_rad};
}

std::size_t Table::bytes_per_row() const {
  std::size_t bytes = 0;
  for_each_column(const_cast<Table&>(*this), [&](auto& column) { bytes += sizeof(column[0]); });
  return bytes;
}

Agent Table::get(int row) const {
  const auto i = static_cast<std::size_t>(row);
  Agent a{id[i], role[i], {}, {}};
  a.state = {{x[i], y[i]},  {vx[i], vy[i]},  heading[i],  phase[i],  length[i],
             phase_rate[i], heading_rate[i], smoothed[i], pressed[i]};
  a.traits = {omega[i], stride[i], radius[i], place[i], lane[i], {goal_x[i], goal_y[i]}};
  return a;
}

void Table::set(int row, const Agent& agent) {
  const auto i = static_cast<std::size_t>(row);
  id[i] = agent.id;
  role[i] = agent.role;
  set_state(row, agent.state);
  set_traits(row, agent.traits);
}

void Table::set_state(int row, const AgentState& s) {
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
}

void Table::set_traits(int row, const AgentTraits& t) {
  const auto i = static_cast<std::size_t>(row);
  omega[i] = t.omega_rad_s;
  stride[i] = static_cast<float>(t.stride);
  radius[i] = static_cast<float>(t.radius_m);
  place[i] = t.place_m;
  lane[i] = t.lane_m;
  goal_x[i] = t.goal_W_m.x();
  goal_y[i] = t.goal_W_m.y();
}

void Table::merge(int first, int count, std::span<const Agent> sorted) {
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

void Table::erase(std::span<const int> rows) {
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
