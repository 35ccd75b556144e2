#include "common/model/files.h"
#include "nodes/walker/bench/percentiles.h"
#include "nodes/walker/tasks/stack.h"
#include "nodes/walker/tasks/test/reference.h"

namespace mimesis::walker {
namespace {

constexpr double kDt = 0.005;
constexpr int kTicks = 1600;

/// Ticks of 5 ms of a walk at 36 velocities. `change` makes it harder.
template <typename Change>
void ticks(benchmark::State& state, Change change) {
  const robot::Biped biped = model::load_biped("biped.yaml");
  const Reference reference(biped);
  const StackSettings settings = walking_stack(biped);
  Percentiles times;
  double limited = 0.0;
  for (auto _ : state) {
    Stack stack(biped, settings);
    for (int tick = 1; tick <= kTicks; ++tick) {
      TaskGoals goals = reference.walk(tick * kDt, 0.3);
      change(tick, goals);
      times.time([&] { benchmark::DoNotOptimize(&stack.step(goals, kDt)); });
      if (!stack.state().reason.empty()) state.SkipWithError(stack.state().reason.c_str());
      limited += stack.state().limited;
    }
  }
  times.report(state);
  state.counters["limited"] = limited / static_cast<double>(state.iterations() * kTicks);
}

void walk(benchmark::State& state) {
  ticks(state, [](int, TaskGoals&) {});
}
BENCHMARK(walk)->Name("stack/walk_0.3_m_s")->Unit(benchmark::kMillisecond);

/// A hand reaches as far as it can while the robot walks: arm and chest at their limits.
void reach(benchmark::State& state) {
  ticks(state, [](int tick, TaskGoals& goals) {
    TaskGoals::Hand& hand = goals.hand[0];
    hand.share = std::min(1.0, tick / 200.0);
    hand.p_W_m = goals.com_W_m + Eigen::Vector3d(1.2, 0.3, 0.4);
  });
}
BENCHMARK(reach)->Name("stack/walk_and_reach_too_far")->Unit(benchmark::kMillisecond);

/// Every joint of the upper body is wished beyond its limits.
void strain(benchmark::State& state) {
  ticks(state, [](int tick, TaskGoals& goals) {
    goals.upper_body.array() += tick / 400 % 2 == 0 ? 3.0 : -3.0;
  });
}
BENCHMARK(strain)->Name("stack/walk_upper_body_at_its_limits")->Unit(benchmark::kMillisecond);

/// The CoM is wished higher than the legs are long: the first level's limits are active.
void stretch(benchmark::State& state) {
  ticks(state, [](int, TaskGoals& goals) { goals.com_W_m.z() += 0.15; });
}
BENCHMARK(stretch)->Name("stack/walk_on_stretched_legs")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mimesis::walker
