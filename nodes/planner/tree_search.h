#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "nodes/planner/collision.h"

namespace mimesis::planner {

struct TreeSettings {
  double step_rad = 2.0;      ///< longest branch that is tried at once [rad]
  int max_branches = 50'000;  ///< effort: branches tried [1]
  std::uint64_t seed = 1;
};

/// Path of certified straight parts from `start` to one of `goals`: by one posture, if one of the
/// few that are tried will do, else by two trees that grow towards random postures and towards each
/// other (RRT-Connect, Kuffner & LaValle 2000). A node whose branches failed is tried for near
/// postures only (dynamic domain, Yershova et al. 2005). Branches are sampled; those of a path are
/// certified when it is found, and cut off if they touch. Where the roadmap is torn, the trees are
/// the new nodes that are "introduced whenever needed" [M18 2.3.2]. Empty if the effort is
/// exhausted, or the checker interrupted. Equal arguments give equal bits.
std::optional<std::vector<Eigen::VectorXd>> join_by_trees(CollisionChecker& checker,
                                                          const Eigen::VectorXd& start,
                                                          std::span<const Eigen::VectorXd> goals,
                                                          const TreeSettings& settings);

}  // namespace mimesis::planner
