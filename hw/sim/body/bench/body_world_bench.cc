#include <benchmark/benchmark.h>

#include "hw/sim/body/body_world.h"
#include "hw/sim/body/test/bodies.h"

namespace mimesis::hw::sim {
namespace {

/// Simulated seconds a second: `real_time_factor`.
void stand(benchmark::State& state, const std::string& file, Plant plant) {
  const TestRobot robot = test_robot(file);
  BodyWorld world(robot.biped, robot.urdf, {.plant = plant});
  for (int i = 0; i < 100; ++i) world.step(robot.half_sitting(), 0.005);
  const double before = world.time_s();
  for (auto _ : state) world.step(robot.half_sitting(), 0.005);
  state.counters["real_time_factor"] =
      benchmark::Counter(world.time_s() - before, benchmark::Counter::kIsRate);
  if (world.truth().fell) state.SkipWithError(world.truth().how.c_str());
}

BENCHMARK_CAPTURE(stand, biped_springs, "biped.yaml", Plant::springs);
BENCHMARK_CAPTURE(stand, biped_servos, "biped.yaml", Plant::servo);

}  // namespace
}  // namespace mimesis::hw::sim
