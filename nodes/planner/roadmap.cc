#include "nodes/planner/roadmap.h"

#include "nodes/planner/sampling.h"

namespace mimesis::planner {

Roadmap build_roadmap(CollisionChecker& checker, const Eigen::MatrixXd& more,
                      const RoadmapSettings& settings) {
  const kin::ArmModel& arm = checker.arm();
  Roadmap roadmap;
  roadmap.nodes.resize(arm.dof(), settings.nodes + more.cols());
  roadmap.nodes.leftCols(settings.nodes) =
      sample_box(arm.q_min, arm.q_max, settings.nodes, settings.seed);
  if (more.cols() > 0) roadmap.nodes.rightCols(more.cols()) = more;
  roadmap.inhibited_share = refine_offline(
      roadmap.nodes, arm.q_min, arm.q_max,
      [&](const Eigen::VectorXd& q) { return checker.free(q); }, settings.refinement);
  roadmap.links = connect(roadmap.nodes, settings.neighbours);
  return roadmap;
}

}  // namespace mimesis::planner
