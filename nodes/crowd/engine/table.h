#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "nodes/crowd/engine/agent.h"

namespace mimesis::crowd {

/// Agents as structure of arrays, in rows ordered by (group, id).
struct Table {
  std::vector<AgentId> id;
  std::vector<Role> role;
  // state
  std::vector<double> x, y, heading, phase;
  std::vector<float> vx, vy, length;
  std::vector<double> phase_rate, heading_rate;
  std::vector<double> smoothed;
  std::vector<std::uint8_t> pressed;
  // traits
  std::vector<double> omega, place, lane, goal_x, goal_y;
  std::vector<float> stride, radius;

  int size() const { return static_cast<int>(id.size()); }

  template <class F>
  static void for_each_column(Table& t, F&& f) {
    f(t.id), f(t.role), f(t.x), f(t.y), f(t.heading), f(t.phase), f(t.vx), f(t.vy), f(t.length);
    f(t.phase_rate), f(t.heading_rate), f(t.smoothed), f(t.pressed), f(t.omega), f(t.place),
        f(t.lane);
    f(t.goal_x), f(t.goal_y), f(t.stride), f(t.radius);
  }
  std::size_t bytes_per_row() const;

  Agent get(int row) const;
  void set(int row, const Agent& agent);
  void set_state(int row, const AgentState& state);
  void set_traits(int row, const AgentTraits& traits);

  /// Rows of `sorted` (by id) into rows [first, first + count), which are ordered by id too.
  void merge(int first, int count, std::span<const Agent> sorted);
  /// Removes rows, ascending.
  void erase(std::span<const int> rows);
};

}  // namespace mimesis::crowd
