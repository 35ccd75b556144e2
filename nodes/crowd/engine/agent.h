#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace mimesis::crowd {

/// Name of an agent, stable for its life, the same in every process; from 1.
using AgentId = std::uint64_t;

/// Tells which process moves an agent, and how it reacts to others.
enum class Role : std::uint8_t {
  own,       ///< moved by `Crowd::step`
  external,  ///< a robot, another program: coupled, but others must yield alone
  seen       ///< like an external agent, but not coupled: a passer-by, or no longer trusted
};
constexpr bool is_coupled(Role r) { return r != Role::seen; }

/// State that changes in a step, and all that the next step needs. W: world, z up.
struct AgentState {
  static constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

  Eigen::Vector2d position_W_m = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity_W_m_s = Eigen::Vector2d::Zero();  ///< in the step before
  double heading_rad = 0.0;                                  ///< ψ, + to the left
  /// φ of the gait, left foot at 0; not wrapped. When agents join a group or its rules change, its
  /// phases are lifted by turns to within π of their circular mean; when a state is set, to within
  /// π of its last value.
  double phase_rad = 0.0;
  double length = 0.0;                ///< μ in the step before; steps are 1 + μ as long
  double phase_rate_rad_s = kNone;    ///< φ̇ at the step before; none: just begun
  double heading_rate_rad_s = kNone;  ///< ψ̇ at the step before; none: just begun
  double smoothed_error_m = 0.0;      ///< ε of rule I's low-pass
  /// 10: inside of others, or stepping back; decreases by one from neighbour to neighbour, which
  /// make room.
  static constexpr int kMostPressed = 10;
  int pressed = 0;
  double held_s = 0.0;  ///< for so long it is held up and looks for a way round; 0: it gets on
};

/// Constants of an agent, set from outside.
struct AgentTraits {
  double omega_rad_s = 0.0;  ///< eigenfrequency of the gait (two steps), >= 0
  double stride = 1.0;       ///< factor of the steps, from the agent's style, > 0
  double radius_m = 0.3;     ///< radius of the disc that no other agent enters, >= 0
  double place_m = 0.0;      ///< dᵢ: its place along the group's path; dᵢⱼ = dᵢ − dⱼ
  double lane_m = 0.0;       ///< its line across the path, + to the left
  Eigen::Vector2d goal_W_m = Eigen::Vector2d::Zero();  ///< goal of HeadingKind::goal
};

struct Agent {
  AgentId id = 0;
  Role role = Role::own;
  AgentState state{};
  AgentTraits traits{};
};

/// Sums over a group's coupled agents: all that all-to-all rules need of them.
struct GroupSums {
  double count = 0.0;
  double cos_phase = 0.0, sin_phase = 0.0;      ///< Σ cos φ, Σ sin φ
  double error_m = 0.0;                         ///< Σ (zᵢ − dᵢ)
  double cos_heading = 0.0, sin_heading = 0.0;  ///< Σ cos ψ, Σ sin ψ
};
GroupSums operator+(const GroupSums& a, const GroupSums& b);

/// Agents as structure of arrays, in rows ordered by (group, id).
struct AgentTable {
  std::vector<AgentId> id;
  std::vector<Role> role;
  // state
  std::vector<double> x, y, heading, phase;
  std::vector<float> vx, vy, length;
  std::vector<double> phase_rate, heading_rate;
  std::vector<double> smoothed;
  std::vector<std::uint8_t> pressed;
  std::vector<float> held;
  // traits
  std::vector<double> omega, place, lane, goal_x, goal_y;
  std::vector<float> stride, radius;

  int size() const { return static_cast<int>(id.size()); }

  template <class F>
  static void for_each_column(AgentTable& t, F&& f) {
    f(t.id), f(t.role), f(t.x), f(t.y), f(t.heading), f(t.phase), f(t.vx), f(t.vy), f(t.length);
    f(t.phase_rate), f(t.heading_rate), f(t.smoothed), f(t.pressed), f(t.held), f(t.omega),
        f(t.place), f(t.lane);
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
