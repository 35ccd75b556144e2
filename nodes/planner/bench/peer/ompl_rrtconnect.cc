// OMPL's RRTConnect on the same queries, its first path: our checker at its nodes and every 1/32
// rad of its motions (OMPL samples motions, it does not certify them), limit 1 s a query.
#include <ompl/base/goals/GoalStates.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include "nodes/planner/bench/query_bench.h"

namespace mimesis::planner {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

Eigen::VectorXd posture(const ob::State* state, int n) {
  return Eigen::VectorXd::Map(state->as<ob::RealVectorStateSpace::StateType>()->values, n);
}

Path plan_by_ompl(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m,
                  const Query& query) {
  const int n = arm.dof();
  ompl::RNG::setSeed(1);  // each turn searches the same, not the luckiest of several searches
  auto space = std::make_shared<ob::RealVectorStateSpace>(static_cast<unsigned>(n));
  ob::RealVectorBounds bounds(static_cast<unsigned>(n));
  for (int j = 0; j < n; ++j) {
    bounds.setLow(static_cast<unsigned>(j), arm.q_min[j]);
    bounds.setHigh(static_cast<unsigned>(j), arm.q_max[j]);
  }
  space->setBounds(bounds);
  CollisionChecker checker(arm, obstacles, margin_m);
  og::SimpleSetup setup(space);
  const auto info = setup.getSpaceInformation();
  setup.setStateValidityChecker(
      [&checker, n](const ob::State* s) { return checker.free(posture(s, n)); });
  info->setStateValidityCheckingResolution(1.0 / 32.0 / space->getMaximumExtent());
  const auto scoped = [&](const Eigen::VectorXd& q) {
    ob::ScopedState<> state(space);
    for (int j = 0; j < n; ++j) state[static_cast<unsigned>(j)] = q[j];
    return state;
  };
  auto goals = std::make_shared<ob::GoalStates>(info);
  for (const auto& goal : query.goals) goals->addState(scoped(goal));
  setup.setStartState(scoped(query.start));
  setup.setGoal(goals);
  setup.setPlanner(std::make_shared<og::RRTConnect>(info));
  if (setup.solve(1.0) != ob::PlannerStatus::EXACT_SOLUTION) return {};
  Path path;
  for (const auto* state : setup.getSolutionPath().getStates()) path.push_back(posture(state, n));
  return path;
}

void ompl_rrtconnect(benchmark::State& state) {
  ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
  plan_blocked_queries(state, plan_first_path, plan_by_ompl);
}
BENCHMARK(ompl_rrtconnect)
    ->Name("peer/ompl_rrtconnect")
    ->DenseRange(0, 2)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mimesis::planner
