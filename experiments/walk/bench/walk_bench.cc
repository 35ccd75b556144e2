// Walker and BodyWorld in one process: how fast the physics walks, and a whole tick of the walker.
#include <benchmark/benchmark.h>

#include "experiments/walk/trial/suites.h"

namespace mimesis::walk {
namespace {

/// Simulated seconds a second: `physics_real_time_factor` of BodyWorld alone, `real_time_factor`
/// with the walker; the walker's ticks in µs.
void walking(benchmark::State& state, hw::sim::Plant plant) {
  const Robot robot = load_robot("biped");
  TrialSpec spec;
  for (const TrialSpec& trial : make_suite("speeds", robot, SuiteOptions(plant))) {
    if (trial.name == "0.2 m/s") spec = trial;
  }
  if (spec.robot == nullptr) return state.SkipWithError("suite 'speeds' has no trial '0.2 m/s'");
  TrialResult result;
  double simulated_s = 0.0;
  for (auto _ : state) {
    result = run_trial(spec);
    simulated_s += spec.duration_s;
  }
  state.counters["real_time_factor"] = benchmark::Counter(simulated_s, benchmark::Counter::kIsRate);
  state.counters["physics_real_time_factor"] = result.real_time_factor;
  state.counters["tick_median_us"] = 1e6 * result.tick_p50_s;
  state.counters["tick_p99_us"] = 1e6 * result.tick_p99_s;
  state.counters["tick_max_us"] = 1e6 * result.tick_max_s;
  if (result.figures.fell) state.SkipWithError("fell");
}

BENCHMARK_CAPTURE(walking, biped_springs, hw::sim::Plant::springs)->Iterations(1);
BENCHMARK_CAPTURE(walking, biped_servos, hw::sim::Plant::servo)->Iterations(1);

}  // namespace
}  // namespace mimesis::walk
