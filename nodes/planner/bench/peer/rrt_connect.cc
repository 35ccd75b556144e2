#include "nodes/planner/bench/peer/rrt_connect.h"

#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>

namespace mimesis::planner::peer {

bool rrt_connect_solves(const kin::ArmModel& arm,
                        const std::function<bool(const Eigen::VectorXd&)>& free,
                        const Eigen::VectorXd& start, const Eigen::VectorXd& goal, double most_s) {
  namespace ob = ompl::base;
  namespace og = ompl::geometric;
  ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
  const auto n = static_cast<unsigned>(arm.dof());
  auto space = std::make_shared<ob::RealVectorStateSpace>(n);
  ob::RealVectorBounds bounds(n);
  for (unsigned j = 0; j < n; ++j) {
    bounds.setLow(j, arm.q_min[static_cast<Eigen::Index>(j)]);
    bounds.setHigh(j, arm.q_max[static_cast<Eigen::Index>(j)]);
  }
  space->setBounds(bounds);
  og::SimpleSetup setup(space);
  setup.setStateValidityChecker([&](const ob::State* s) {
    return free(Eigen::VectorXd::Map(s->as<ob::RealVectorStateSpace::StateType>()->values, n));
  });
  setup.getSpaceInformation()->setStateValidityCheckingResolution(1.0 / 32.0 /
                                                                  space->getMaximumExtent());
  ob::ScopedState<> from(space), to(space);
  for (unsigned j = 0; j < n; ++j) {
    from[j] = start[static_cast<Eigen::Index>(j)];
    to[j] = goal[static_cast<Eigen::Index>(j)];
  }
  setup.setStartAndGoalStates(from, to);
  setup.setPlanner(std::make_shared<og::RRTConnect>(setup.getSpaceInformation()));
  return setup.solve(most_s) == ob::PlannerStatus::EXACT_SOLUTION;
}

}  // namespace mimesis::planner::peer
