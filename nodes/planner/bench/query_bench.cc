#include "nodes/planner/bench/query_bench.h"

#include <algorithm>
#include <chrono>
#include <memory>
#include <numeric>

#include "nodes/planner/path_search.h"
#include "nodes/planner/roadmap.h"

namespace mimesis::planner {
namespace {

std::vector<Query> blocked(const kin::ArmModel& arm, const ProblemScene& scene) {
  CollisionChecker checker(arm, scene.obstacles, 0.0);
  std::vector<Query> queries;
  for (const Query& query : scene.queries) {
    const bool straight =
        std::any_of(query.goals.begin(), query.goals.end(),
                    [&](const auto& goal) { return checker.certify(query.start, goal); });
    if (!straight) queries.push_back(query);
  }
  return queries;
}

bool all_certified(CollisionChecker& checker, const Path& path) {
  for (std::size_t i = 1; i < path.size(); ++i) {
    if (!checker.certify(path[i - 1], path[i])) return false;
  }
  return true;
}

PlanQuery prepare_ours(const kin::ArmModel& arm, const Obstacles& obstacles) {
  auto checker = std::make_shared<CollisionChecker>(arm, obstacles, 0.001);
  auto roadmap =
      std::make_shared<Roadmap>(build_roadmap(*checker, Eigen::MatrixXd(arm.dof(), 0), {}));
  return [checker, roadmap](const Query& query) {
    auto found = find_path(*roadmap, *checker, query.start, query.goals, {}, {});
    return found ? std::move(found->waypoints) : Path{};
  };
}

void queries(benchmark::State& state) { plan_blocked_queries(state, prepare_ours); }
BENCHMARK(queries)->DenseRange(0, 4)->Iterations(1)->Unit(benchmark::kMillisecond);

}  // namespace

void plan_blocked_queries(benchmark::State& state, const PrepareScene& prepare) {
  static const auto set = load_problem_set("lwr4p");
  if (!set) {
    state.SkipWithError("no ../shared/data/planner");
    return;
  }
  const ProblemScene& scene = set->scenes.at(static_cast<std::size_t>(state.range(0)));
  const std::vector<Query> asked = blocked(set->arm, scene);
  const auto preparing = std::chrono::steady_clock::now();
  const PlanQuery plan = prepare(set->arm, scene.obstacles);
  const std::chrono::duration<double, std::milli> prepared =
      std::chrono::steady_clock::now() - preparing;
  CollisionChecker judge(set->arm, scene.obstacles, 0.0);
  std::vector<double> ms;
  int solved = 0, certified = 0;
  for (auto _ : state) {
    for (const Query& query : asked) {
      const auto begin = std::chrono::steady_clock::now();
      const Path path = plan(query);
      const std::chrono::duration<double, std::milli> spent =
          std::chrono::steady_clock::now() - begin;
      state.PauseTiming();
      ms.push_back(spent.count());
      solved += !path.empty();
      certified += !path.empty() && all_certified(judge, path);
      state.ResumeTiming();
    }
  }
  std::sort(ms.begin(), ms.end());
  state.SetLabel(scene.name);
  state.counters["asked"] = static_cast<double>(ms.size());
  state.counters["solved"] = solved;
  state.counters["certified"] = certified;
  if (ms.empty()) return;
  state.counters["median_ms"] = ms[ms.size() / 2];
  state.counters["p95_ms"] = ms[ms.size() * 95 / 100];
  state.counters["prepare_ms"] = prepared.count();
  state.counters["mean_prepared_ms"] =
      (prepared.count() + std::accumulate(ms.begin(), ms.end(), 0.0)) /
      static_cast<double>(ms.size());
}

}  // namespace mimesis::planner
