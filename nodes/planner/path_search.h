#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <tl/expected.hpp>
#include <vector>

#include "common/error.h"
#include "nodes/planner/collision.h"
#include "nodes/planner/roadmap.h"

namespace mimesis::planner {

struct SearchSettings {
  int neighbours = 4;          ///< k for nodes added to the roadmap [1]
  int online_refinements = 2;  ///< iterations around the found path [1]
  int rescues = 40;            ///< rounds of new nodes where the network is torn [1]
  int max_waves = 2000;        ///< effort: each wave that fails costs one link [1]
  int shortcuts = 150;         ///< attempts to shorten the path [1]
  std::uint64_t seed = 1;
};

/// A path of certified straight parts in joint space.
struct FoundPath {
  std::vector<Eigen::VectorXd> waypoints;  ///< [rad]
  int goal = 0;                            ///< which of the goals it ends in
  int waves = 0;                           ///< 0: the straight line was free
  int links_checked = 0;
  int nodes = 0;  ///< of the network at the end
};

/// Link cost of postures: 1, or less in regions that F5 prefers (see wave.h). May be empty.
using PostureCost = std::function<double(const Eigen::VectorXd&)>;

/// Finds a path from `start` to any of `goals` that `checker` certifies:
/// straight line if free, else waves on the roadmap, links of the found path certified, failing
/// ones cut, until a whole path stands; on-line refinement around it [M18 2.3.2]; shortcuts. Where
/// the network is torn, new nodes are put around the links that were cut ("new nodes are introduced
/// whenever needed"). Failure: a reason in words (start or goals in collision and with what, no
/// connection, effort exhausted).
tl::expected<FoundPath, Status> find_path(const Roadmap& roadmap, CollisionChecker& checker,
                                          const Eigen::VectorXd& start,
                                          std::span<const Eigen::VectorXd> goals,
                                          const PostureCost& cost, const SearchSettings& settings);

/// Σ |qᵢ₊₁ − qᵢ| [rad].
double path_length(std::span<const Eigen::VectorXd> waypoints);

}  // namespace mimesis::planner
