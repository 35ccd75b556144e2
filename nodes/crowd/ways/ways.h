#pragma once
#include <Eigen/Core>
#include <map>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "nodes/crowd/rules/rules.h"

namespace mimesis::crowd {

/// Obstacle with an inside; its edges are walls.
struct Polygon {
  std::vector<double> corner_m{};  ///< x, y in W of one after the other, either way round
};
/// On the edge counts as inside.
bool inside(const Polygon& polygon, const Eigen::Vector2d& p_W_m);
/// They have a point in common.
bool meet(const Wall& a, const Wall& b);
/// Walls, and the edges of polygons.
std::vector<Wall> edges(std::span<const Wall> walls, std::span<const Polygon> polygons);

/// Shortest ways between walls for a disc of some radius, along a roadmap of the bends that a way
/// can have: where a wall ends, or turns away, a way bends about its end on arcs, here polygons of
/// 45 degrees a side around them [visibility graph: Lozano-Pérez, Wesley 1979]. Ways are at most
/// 8 % longer about each bend than the shortest, and gaps of 2.17 clearances are open, of 1.7
/// closed.
///
/// Building costs O(bends² walls/16), 0.3 s for 300 walls, a goal O(bends²) once, `next` O(bends
/// walls).
class Ways {
 public:
  /// @param clearance_m  distance from walls that ways keep, > 0, where both ends have it
  Ways(std::span<const Wall> walls, std::span<const Polygon> polygons, double clearance_m);

  int bends() const { return static_cast<int>(bends_.size()); }
  /// The straight line is free.
  bool sees(const Eigen::Vector2d& a_W_m, const Eigen::Vector2d& b_W_m) const {
    return free(a_W_m, b_W_m, clearance_m_);
  }
  /// Where to go next on the way from one place to another: the goal where it is seen; empty: there
  /// is no way. Keeps what it has found out of a goal.
  std::optional<Eigen::Vector2d> next(const Eigen::Vector2d& from_W_m,
                                      const Eigen::Vector2d& goal_W_m);
  /// Length of that way [m].
  std::optional<double> length_m(const Eigen::Vector2d& from_W_m, const Eigen::Vector2d& goal_W_m);

 private:
  using Costs = std::vector<double>;  // of the way from each bend to the goal; infinite: none
  struct Link {
    int to;
    double length_m;
  };
  bool free(const Eigen::Vector2d& a, const Eigen::Vector2d& b, double clearance_m) const;
  double clearance(const Eigen::Vector2d& p) const;
  void add_bends(std::span<const Polygon> polygons);
  const Costs& costs_to(const Eigen::Vector2d& goal);
  std::pair<int, double> first_bend(const Eigen::Vector2d& from, const Eigen::Vector2d& goal);

  double clearance_m_;
  std::vector<Wall> walls_;
  std::vector<Eigen::Vector2d> bends_, outwards_;  // outwards: from what it bends about
  std::vector<std::vector<Link>> links_;
  std::map<std::pair<double, double>, Costs> known_;
};

}  // namespace mimesis::crowd
