// OMPL on the same queries: our checker at its nodes and every 1/32 rad of its motions (OMPL
// samples motions, it does not certify them).
#include <ompl/base/goals/GoalStates.h>
#include <ompl/base/objectives/PathLengthOptimizationObjective.h>
#include <ompl/base/spaces/RealVectorStateSpace.h>
#include <ompl/geometric/PathSimplifier.h>
#include <ompl/geometric/SimpleSetup.h>
#include <ompl/geometric/planners/informedtrees/BITstar.h>
#include <ompl/geometric/planners/rrt/RRTConnect.h>
#include <ompl/util/Console.h>
#include <ompl/util/RandomNumbers.h>

#include <utility>

#include "nodes/planner/bench/query_bench.h"
#include "nodes/planner/path_search.h"

namespace mimesis::planner {
namespace {

namespace ob = ompl::base;
namespace og = ompl::geometric;

Eigen::VectorXd posture(const ob::State* state, int n) {
  return Eigen::VectorXd::Map(state->as<ob::RealVectorStateSpace::StateType>()->values, n);
}

/// A query as OMPL takes it, and a planner of this kind for it.
class Problem {
 public:
  template <class Planner>
  Problem(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m, const Query& query,
          std::in_place_type_t<Planner>)
      : n_(arm.dof()), checker_(arm, obstacles, margin_m), setup_(space_of(arm)) {
    const auto info = setup_.getSpaceInformation();
    setup_.setStateValidityChecker(
        [this](const ob::State* s) { return checker_.free(posture(s, n_)); });
    info->setStateValidityCheckingResolution(1.0 / 32.0 /
                                             setup_.getStateSpace()->getMaximumExtent());
    auto goals = std::make_shared<ob::GoalStates>(info);
    for (const auto& goal : query.goals) goals->addState(scoped(goal));
    setup_.setStartState(scoped(query.start));
    setup_.setGoal(goals);
    setup_.setPlanner(std::make_shared<Planner>(info));
  }

  og::SimpleSetup& setup() { return setup_; }
  /// Empty unless a goal is reached.
  Path solve(const ob::PlannerTerminationCondition& end) {
    if (setup_.solve(end) != ob::PlannerStatus::EXACT_SOLUTION) return {};
    return path();
  }
  Path path() {
    Path path;
    for (const auto* state : setup_.getSolutionPath().getStates())
      path.push_back(posture(state, n_));
    return path;
  }

 private:
  static ob::StateSpacePtr space_of(const kin::ArmModel& arm) {
    auto space = std::make_shared<ob::RealVectorStateSpace>(static_cast<unsigned>(arm.dof()));
    ob::RealVectorBounds bounds(static_cast<unsigned>(arm.dof()));
    for (int j = 0; j < arm.dof(); ++j) {
      bounds.setLow(static_cast<unsigned>(j), arm.q_min[j]);
      bounds.setHigh(static_cast<unsigned>(j), arm.q_max[j]);
    }
    space->setBounds(bounds);
    return space;
  }
  ob::ScopedState<> scoped(const Eigen::VectorXd& q) {
    ob::ScopedState<> state(setup_.getStateSpace());
    for (int j = 0; j < n_; ++j) state[static_cast<unsigned>(j)] = q[j];
    return state;
  }

  int n_;
  CollisionChecker checker_;
  og::SimpleSetup setup_;
};

/// RRTConnect's first path, limit 1 s a query.
Path plan_by_rrtconnect(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m,
                        const Query& query) {
  ompl::RNG::setSeed(1);  // each turn searches the same, not the luckiest of several searches
  Problem problem(arm, obstacles, margin_m, query, std::in_place_type<og::RRTConnect>);
  return problem.solve(ob::timedPlannerTerminationCondition(1.0));
}

/// RRTConnect again and again, each path shortened by all that OMPL's simplifier does; the
/// shortest.
Path shorten_by_rrtconnect(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m,
                           const Query& query, double end_us, std::uint64_t seed) {
  ompl::RNG::setSeed(seed);
  Problem problem(arm, obstacles, margin_m, query, std::in_place_type<og::RRTConnect>);
  const ob::PlannerTerminationCondition end([end_us] { return processor_us() > end_us; });
  og::PathSimplifier simplifier(problem.setup().getSpaceInformation(), problem.setup().getGoal());
  Path best;
  while (!end()) {
    problem.setup().clear();
    if (problem.solve(end).empty()) break;
    simplifier.simplify(problem.setup().getSolutionPath(), end);
    Path path = problem.path();
    if (best.empty() || path_length(path) < path_length(best)) best = std::move(path);
  }
  return best;
}

/// BIT*, which gets nearer to the shortest path the longer it searches.
Path shorten_by_bitstar(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m,
                        const Query& query, double end_us, std::uint64_t seed) {
  ompl::RNG::setSeed(seed);
  Problem problem(arm, obstacles, margin_m, query, std::in_place_type<og::BITstar>);
  problem.setup().setOptimizationObjective(
      std::make_shared<ob::PathLengthOptimizationObjective>(problem.setup().getSpaceInformation()));
  return problem.solve(
      ob::PlannerTerminationCondition([end_us] { return processor_us() > end_us; }));
}

void ompl_rrtconnect(benchmark::State& state) {
  ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
  plan_blocked_queries(state, plan_first_path, plan_by_rrtconnect);
}
BENCHMARK(ompl_rrtconnect)
    ->Name("peer/ompl_rrtconnect")
    ->DenseRange(0, 2)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

void ompl_lengths(benchmark::State& state, const PlanFor& plan) {
  ompl::msg::setLogLevel(ompl::msg::LOG_NONE);
  measure_lengths(state, plan);
}
BENCHMARK_CAPTURE(ompl_lengths, rrtconnect, shorten_by_rrtconnect)
    ->Name("peer/lengths/ompl_rrtconnect")
    ->DenseRange(0, 2)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(ompl_lengths, bitstar, shorten_by_bitstar)
    ->Name("peer/lengths/ompl_bitstar")
    ->DenseRange(0, 2)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mimesis::planner
