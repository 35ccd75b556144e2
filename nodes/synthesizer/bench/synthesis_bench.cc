#include <benchmark/benchmark.h>

#include <array>

#include "nodes/synthesizer/dynamics/character_batch.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"

namespace mimesis::synthesizer {
namespace {

/// One frame at 60 Hz of as many characters as the argument says: oscillators, postures of 51 rows
/// from 4 sources, forward kinematics of 17 joints, root motion. Time per item: a character frame.
enum class Parameters { pattern, blend, own };

void frame(benchmark::State& state, Parameters parameters, bool foot_lock) {
  const int count = static_cast<int>(state.range(0));
  const motion::MotionModel model = testing::random_model(1);
  CharacterBatch batch(
      model, count,
      {.harmonics = 10, .individual = parameters == Parameters::own, .foot_lock = foot_lock});
  for (int i = 0; i < count; ++i) {
    const motion::Pattern& p = model.patterns[static_cast<std::size_t>(i % 3)];
    batch.set_pattern(i, i % 3);
    batch.set_phase(i, 0.01 * i);
    if (parameters == Parameters::blend) batch.set_blend(i, std::array{0.5, 0.3, 0.2});
    if (parameters == Parameters::own) {
      batch.set_parameters(i, p.mean_rad, p.weight_rad, p.delay_rad, std::array{1.0, 0.0, 0.0});
    }
  }
  for (auto _ : state) {
    batch.step();
    benchmark::ClobberMemory();
  }
  state.SetItemsProcessed(state.iterations() * count);
  state.counters["s_per_character"] =
      benchmark::Counter(static_cast<double>(count), benchmark::Counter::kIsIterationInvariantRate |
                                                         benchmark::Counter::kInvert);
  state.counters["harmonics"] = batch.series().harmonics();
}

void crowd(benchmark::State& state) { frame(state, Parameters::pattern, false); }
void crowd_foot_lock(benchmark::State& state) { frame(state, Parameters::pattern, true); }
void crowd_blend_of_3(benchmark::State& state) { frame(state, Parameters::blend, false); }
void crowd_own_parameters(benchmark::State& state) { frame(state, Parameters::own, false); }
BENCHMARK(crowd)->Arg(1)->Arg(100)->Arg(1000)->Arg(30000);
BENCHMARK(crowd_foot_lock)->Arg(1)->Arg(100)->Arg(1000)->Arg(30000);
BENCHMARK(crowd_blend_of_3)->Arg(1000)->Arg(30000);
BENCHMARK(crowd_own_parameters)->Arg(1000)->Arg(30000);

void set_parameters(benchmark::State& state) {  // a new series, of 51 rows and 4 sources
  const motion::MotionModel model = testing::random_model(1);
  CharacterBatch batch(model, 1, {.harmonics = 10, .individual = true});
  const motion::Pattern& p = model.patterns[1];
  for (auto _ : state)
    batch.set_parameters(0, p.mean_rad, p.weight_rad, p.delay_rad, std::array{0.0, 1.0, 0.0});
}
BENCHMARK(set_parameters);

}  // namespace
}  // namespace mimesis::synthesizer
