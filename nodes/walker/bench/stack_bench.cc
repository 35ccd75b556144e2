#include "common/model/files.h"
#include "nodes/walker/bench/percentiles.h"
#include "nodes/walker/tasks/stack.h"
#include "nodes/walker/tasks/test/reference.h"

namespace mimesis::walker {
namespace {

constexpr double kDt = 0.005;
constexpr int kTicks = 1600;

/// Ticks of 5 ms of a walk at 36 velocities.
void walk(benchmark::State& state) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  const Reference reference(biped);
  const StackSettings settings = walking_stack(biped);
  Percentiles times;
  for (auto _ : state) {
    Stack stack(biped, settings);
    for (int tick = 1; tick <= kTicks; ++tick) {
      const TaskGoals goals = reference.walk(tick * kDt, 0.3);
      times.time([&] { benchmark::DoNotOptimize(&stack.step(goals, kDt)); });
      if (!stack.state().reason.empty()) state.SkipWithError(stack.state().reason.c_str());
    }
  }
  times.report(state);
}
BENCHMARK(walk)->Name("stack/walk_0.3_m_s")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mimesis::walker
