#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "nodes/planner/collision.h"
#include "nodes/planner/linkage.h"
#include "nodes/planner/refinement.h"

namespace mimesis::planner {

struct RoadmapSettings {
  int nodes = 2500;    ///< sampled over the joint limits; the thesis: two to three thousand [1]
  int neighbours = 4;  ///< k [1]
  std::uint64_t seed = 1;
  RefinementSettings refinement;
};

/// Network of postures that covers the joint space [M18 2.3.2]. Every node was free when it was
/// built; its links are not checked until a path wants them.
struct Roadmap {
  Eigen::MatrixXd nodes;  ///< n × N [rad]
  Linkage links;
  std::vector<double> inhibited_share;  ///< per iteration of the off-line refinement [1]
};

/// Samples, adds `more` postures (columns; from inverse kinematics), refines against what `checker`
/// knows, connects. The same arguments give the same bits.
Roadmap build_roadmap(CollisionChecker& checker, const Eigen::MatrixXd& more,
                      const RoadmapSettings& settings);

}  // namespace mimesis::planner
