#pragma once
#include <cstdint>
#include <limits>
#include <span>
#include <utility>
#include <vector>

#include "nodes/crowd/engine/agent.h"

namespace mimesis::crowd {

/// Discs of agents in the plane: how near they came to each other, and how often two began to
/// overlap. By a sweep along x: O(N log N), O(N) once sorted, for crowds that are not one column.
class Closeness {
 public:
  struct Disc {
    AgentId id;
    double x_m, y_m, radius_m;
    bool counts;  ///< false: of another coordinator
  };

  /// @param slack_m  discs overlap if they do so by more than this
  explicit Closeness(double slack_m = 1e-3) : slack_m_(slack_m) {}

  /// Everybody at one instant, in any order. A pair is counted if the disc with the smaller id
  /// counts, so that of several coordinators one does.
  void observe(std::span<const Disc> discs);

  double least_gap_m() const { return least_gap_m_; }  ///< between two discs, since the start
  double least_distance_m() const { return least_distance_m_; }  ///< between two middles, likewise
  std::uint64_t collisions() const { return collisions_; }       ///< overlaps that began
  /// Pairs that overlap, smaller id first, ascending.
  std::span<const std::pair<AgentId, AgentId>> overlapping() const { return overlapping_; }

 private:
  double slack_m_;
  double least_gap_m_ = std::numeric_limits<double>::infinity();
  double least_distance_m_ = std::numeric_limits<double>::infinity();
  std::uint64_t collisions_ = 0;
  std::vector<Disc> sorted_;
  std::vector<std::pair<AgentId, AgentId>> overlapping_, before_;
};

}  // namespace mimesis::crowd
