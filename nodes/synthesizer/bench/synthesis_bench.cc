#include <benchmark/benchmark.h>

#include "nodes/synthesizer/dynamics/character_batch.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer {
namespace {

/// One frame at 60 Hz of as many characters as the argument says: oscillators, postures of 51 rows
/// from 4 sources, forward kinematics of 17 joints, root motion. Time per item: a character frame.
void frame(benchmark::State& state, const CharacterOptions& options) {
  const int count = static_cast<int>(state.range(0));
  const MotionModel model = testing::random_model(1);
  CharacterBatch batch(model, count, options);
  for (int i = 0; i < count; ++i) {
    batch.set_pattern(i, i % 3);
    batch.set_phase(i, 0.01 * i);
    if (options.individual) batch.set_blend(i, std::array<double, 3>{0.5, 0.3, 0.2});
  }
  for (auto _ : state) {
    batch.step();
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * count);
  state.counters["ns_per_character"] = benchmark::Counter(
      1e-9 * static_cast<double>(count) * static_cast<double>(state.iterations()),
      benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
  state.counters["harmonics"] = batch.series().harmonics();
}

void crowd(benchmark::State& state) { frame(state, {.harmonics = 10}); }
void crowd_foot_lock(benchmark::State& state) {
  frame(state, {.harmonics = 10, .foot_lock = true});
}
void crowd_individual(benchmark::State& state) {  // a series of its own per character
  frame(state, {.harmonics = 10, .individual = true});
}
BENCHMARK(crowd)->Arg(1)->Arg(100)->Arg(1000)->Arg(30000);
BENCHMARK(crowd_foot_lock)->Arg(1)->Arg(100)->Arg(1000)->Arg(30000);
BENCHMARK(crowd_individual)->Arg(1)->Arg(100)->Arg(1000)->Arg(30000);

}  // namespace
}  // namespace mimesis::synthesizer
