#include <benchmark/benchmark.h>

#include "common/model/files.h"
#include "nodes/planner/path_search.h"
#include "nodes/planner/roadmap.h"
#include "nodes/planner/task_plan.h"

namespace mimesis::planner {
namespace {

/// Arm, table and roadmap of the demo.
struct Demo {
  kin::ArmModel arm = model::load_arm("lwr4.yaml");
  kin::Table table = model::load_table("bridge_table.yaml");
  Obstacles obstacles{table.balls, table.boxes, {}, {}};
  TaskSettings settings;
  Roadmap roadmap = prepare_roadmap(arm, table, settings);
  Eigen::MatrixXd postures = sample_box(arm.q_min, arm.q_max, 4096, 3);
};

const Demo& demo() {
  static const Demo one;
  return one;
}

void posture(benchmark::State& state) {  // 22 balls against bridge and boxes, 111 own pairs
  const Demo& d = demo();
  CollisionChecker checker(d.arm, d.obstacles, d.settings.margin_m);
  Eigen::Index i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(checker.free(d.postures.col(i)));
    i = (i + 1) % d.postures.cols();
  }
}
BENCHMARK(posture);

void postures(benchmark::State& state) {  // the same, many at once; time of one
  const Demo& d = demo();
  CollisionChecker checker(d.arm, d.obstacles, d.settings.margin_m);
  for (auto _ : state) benchmark::DoNotOptimize(checker.free_columns(d.postures));
  state.counters["per_posture"] = benchmark::Counter(
      static_cast<double>(d.postures.cols()),
      benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(postures)->Unit(benchmark::kMicrosecond);

void certified_link(benchmark::State& state) {
  const Demo& d = demo();
  CollisionChecker checker(d.arm, d.obstacles, d.settings.margin_m);
  std::size_t i = 0;
  for (auto _ : state) {
    const Link& link = d.roadmap.links[i].front();
    benchmark::DoNotOptimize(checker.certify(d.roadmap.nodes.col(static_cast<Eigen::Index>(i)),
                                             d.roadmap.nodes.col(link.to)));
    i = (i + 1) % d.roadmap.links.size();
  }
  state.counters["postures"] = benchmark::Counter(static_cast<double>(checker.postures_checked()),
                                                  benchmark::Counter::kAvgIterations);
}
BENCHMARK(certified_link);

void wave(benchmark::State& state) {  // over the whole roadmap: the start is never reached
  const Demo& d = demo();
  Linkage links = d.roadmap.links;
  links.emplace_back();
  const std::vector<char> inhibited(links.size(), 0);
  const std::vector<int> goals{0};
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        expand_wave(links, inhibited, {}, static_cast<int>(links.size()) - 1, goals));
  }
}
BENCHMARK(wave);

void roadmap(benchmark::State& state) {
  const Demo& d = demo();
  for (auto _ : state) benchmark::DoNotOptimize(prepare_roadmap(d.arm, d.table, d.settings));
}
BENCHMARK(roadmap)->Unit(benchmark::kMillisecond);

void task(benchmark::State& state) {  // 0: precision, above, high; 1: full, below, low
  const Demo& d = demo();
  const Task task = state.range(0) == 0 ? Task{Grip::precision, Transport::above, "high"}
                                        : Task{Grip::full, Transport::below, "low"};
  for (auto _ : state) {
    const auto plan = plan_task(d.arm, d.table, d.roadmap, d.arm.home, task, d.settings);
    if (!plan) state.SkipWithError(plan.error().reason.c_str());
  }
}
BENCHMARK(task)->Arg(0)->Arg(1)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mimesis::planner
