#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <random>

#include "common/model/files.h"
#include "common/time.h"
#include "nodes/planner/bench/query_bench.h"
#include "nodes/planner/path_search.h"
#include "nodes/planner/task_plan.h"

namespace mimesis::planner {
namespace {

/// Arm, table and roadmap of the demo.
struct Demo {
  kin::ArmModel arm = model::load_arm("lwr4.yaml");
  kin::Table table = model::load_table("bar_table.yaml");
  Obstacles obstacles{table.balls, table.boxes, {}, {}};
  TaskSettings settings;
  Roadmap roadmap = prepare_roadmap(arm, table, settings);
  Eigen::MatrixXd postures = sample_box(arm.q_min, arm.q_max, 4096, 3);
};

const Demo& demo() {
  static const Demo one;
  return one;
}

void posture(benchmark::State& state) {  // 22 balls against bar and boxes, 111 own pairs
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
    const Link& link = d.roadmap.links()[i].front();
    benchmark::DoNotOptimize(checker.certify(d.roadmap.nodes().col(static_cast<Eigen::Index>(i)),
                                             d.roadmap.nodes().col(link.to)));
    i = (i + 1) % d.roadmap.links().size();
  }
  state.counters["postures"] = benchmark::Counter(static_cast<double>(checker.postures_checked()),
                                                  benchmark::Counter::kAvgIterations);
}
BENCHMARK(certified_link);

void wave(benchmark::State& state) {  // over the whole roadmap
  const Linkage& links = demo().roadmap.links();
  const std::vector<char> none(links.size(), 0);
  std::vector<char> one = none;
  one.back() = 1;
  std::vector<std::pair<int, int>> ends;  // a goal, and the node that its wave reaches last
  for (int goal = 0; ends.size() < 200; goal += 7) {
    const auto arrival =
        expand_wave(links, one, {}, demo().roadmap.size() - 1, std::span(&goal, 1)).arrival;
    const auto last = std::ranges::max_element(arrival) - arrival.begin();
    ends.emplace_back(goal, static_cast<int>(last));
  }
  std::size_t i = 0;
  for (auto _ : state) {  // other ends each time: no processor learns the way by heart
    const auto& [goal, start] = ends[i++ % ends.size()];
    benchmark::DoNotOptimize(expand_wave(links, none, {}, start, std::span(&goal, 1)));
  }
}
BENCHMARK(wave);

/// The demo's roadmap and its table with the bar moved by 1 mm to the side in each round.
struct Moved {
  Demo d = demo();
  std::vector<CollisionChecker> checkers;
  Moved() {
    for (int i = 0; i < 20; ++i) {
      for (auto& ball : d.obstacles.balls) ball.center.y() += 0.001;
      checkers.emplace_back(d.arm, d.obstacles, d.settings.margin_m);
    }
  }
};

void moved_nodes(benchmark::State& state) {
  Moved moved;
  std::size_t i = 0;
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        moved.checkers[i++ % moved.checkers.size()].free_columns(moved.d.roadmap.nodes()));
  }
  state.counters["nodes"] = static_cast<double>(moved.d.roadmap.nodes().cols());
}
BENCHMARK(moved_nodes)->Unit(benchmark::kMicrosecond);

void moved_links(benchmark::State& state) {  // all of them certified anew
  Moved moved;
  std::size_t round = 0;
  long links = 0, free = 0;
  for (auto _ : state) {
    CollisionChecker& checker = moved.checkers[round++ % moved.checkers.size()];
    links = free = 0;
    for (std::size_t i = 0; i < moved.d.roadmap.links().size(); ++i) {
      for (const Link& link : moved.d.roadmap.links()[i]) {
        if (link.to < static_cast<int>(i)) continue;
        ++links;
        free += checker.certify(moved.d.roadmap.nodes().col(static_cast<Eigen::Index>(i)),
                                moved.d.roadmap.nodes().col(link.to));
      }
    }
  }
  state.counters["links"] = static_cast<double>(links);
  state.counters["free"] = static_cast<double>(free);
}
BENCHMARK(moved_links)->Unit(benchmark::kMillisecond);

/// Between nodes whose straight line is blocked, once the nodes are judged again (moved_nodes).
void moved_path(benchmark::State& state) {
  Moved moved;
  std::vector<std::vector<char>> free_nodes;
  for (CollisionChecker& checker : moved.checkers)
    free_nodes.push_back(checker.free_columns(moved.d.roadmap.nodes()));
  const Eigen::Index n = moved.d.roadmap.nodes().cols();
  Eigen::Index i = 0;
  std::vector<double> us;
  long found = 0;
  for (auto _ : state) {
    CollisionChecker* checker = nullptr;
    Eigen::VectorXd start, goal;
    do {
      ++i;
      checker = &moved.checkers[static_cast<std::size_t>(i) % moved.checkers.size()];
      start = moved.d.roadmap.nodes().col(7 * i % n);
      goal = moved.d.roadmap.nodes().col((13 * i + 5) % n);
    } while (!checker->free(start) || !checker->free(goal) || checker->certify(start, goal));
    const double begin_us = processor_us();
    found += find_path(moved.d.roadmap, *checker, start, std::span(&goal, 1), {},
                       {.online_refinements = 0, .shortcuts = 0},
                       free_nodes[static_cast<std::size_t>(i) % moved.checkers.size()])
                 .has_value();
    us.push_back(processor_us() - begin_us);
  }
  std::sort(us.begin(), us.end());
  state.counters["median_us"] = us[us.size() / 2];
  state.counters["p95_us"] = us[us.size() * 95 / 100];
  state.counters["found"] = static_cast<double>(found) / static_cast<double>(us.size());
}
BENCHMARK(moved_path)->Iterations(1000)->Unit(benchmark::kMicrosecond);

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

/// How late a plan ends after deadlines at random times of the whole work: roadmap and task.
void deadline(benchmark::State& state) {
  using Clock = std::chrono::steady_clock;
  const Demo& d = demo();
  const Task task{Grip::full, Transport::below, "low"};
  const auto work = [&](const TaskSettings& settings) {
    const Roadmap roadmap = prepare_roadmap(d.arm, d.table, settings);
    return !settings.interrupt.told() &&
           plan_task(d.arm, d.table, roadmap, d.arm.home, task, settings).has_value();
  };
  const auto begin = Clock::now();
  if (!work(d.settings)) return state.SkipWithError("no plan");
  const double whole_us = std::chrono::duration<double, std::micro>(Clock::now() - begin).count();
  std::mt19937_64 random(7);
  std::vector<double> late_us;
  std::string latest;
  for (auto _ : state) {
    const auto end = Clock::now() + std::chrono::duration_cast<Clock::duration>(
                                        std::chrono::duration<double, std::micro>(
                                            std::uniform_real_distribution(0.0, whole_us)(random)));
    TaskSettings settings = d.settings;
    settings.interrupt = Interrupt(
        "", [end] { return Clock::now() + from_seconds(kLongestPart_s) >= end; },
        kQuestionsPerLook);
    if (work(settings)) continue;
    late_us.push_back(std::chrono::duration<double, std::micro>(Clock::now() - end).count());
    if (late_us.back() == std::ranges::max(late_us)) latest = settings.interrupt.reason().reason;
  }
  std::sort(late_us.begin(), late_us.end());
  state.SetLabel("latest" + latest);
  state.counters["passed"] = static_cast<double>(late_us.size());
  state.counters["median_us"] = late_us[late_us.size() / 2];
  state.counters["p95_us"] = late_us[late_us.size() * 95 / 100];
  state.counters["worst_us"] = late_us.back();
}
BENCHMARK(deadline)->Iterations(200)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mimesis::planner
