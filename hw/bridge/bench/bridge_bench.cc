// Full cycle of seven axes on the embedded bus: set-points and SYNC out, seven drives answer in the
// same thread, feedback in. With and without the drives' own work.
#include <benchmark/benchmark.h>

#include <filesystem>

#include "hw/arm/arm_driver.h"
#include "hw/sim/drives/rack.h"

namespace mimesis::hw {
namespace {

using namespace std::chrono_literals;

constexpr int kAxes = 7;
constexpr Time kCycle = 5ms;

void full_cycle(benchmark::State& state) {
  std::string directory =
      (std::filesystem::temp_directory_path() / "mimesis-bench-XXXXXX").string();
  if (mkdtemp(directory.data()) == nullptr) return state.SkipWithError("no temporary directory");
  {
    const auto all = [](double x) { return Eigen::VectorXd::Constant(kAxes, x); };
    std::vector<sim::DriveConfig> drives;
    for (int i = 1; i <= kAxes; ++i) drives.push_back({.axis = {.node_id = i}});
    sim::Rack rack(drives, can::open("embedded:bench", directory));
    arm::ArmDriver driver(
        {.axes = arm::complete({}, kAxes),
         .limits = {.q_min = all(-2), .q_max = all(2), .v_max = all(2), .a_max = all(10)}},
        can::open("embedded:bench", directory));
    Time now = 1s;
    std::vector<double> q(kAxes, 0.0);
    Phase phase = Phase::starting;
    const auto cycle = [&](Mode mode) {
      phase = driver.read(now).phase;
      driver.write(now, {.mode = mode, .position_rad = q});
    };
    for (; now < 3s; now += kCycle) {
      cycle(now < 2s ? Mode::idle : Mode::follow);
      rack.step(now + kCycle / 2);
    }
    if (phase != Phase::following) state.SkipWithError("the arm does not follow");
    const bool driver_only = state.range(0) != 0;
    for (auto _ : state) {
      cycle(Mode::follow);
      if (driver_only) state.PauseTiming();
      rack.step(now + kCycle / 2);
      now += kCycle;
      if (driver_only) state.ResumeTiming();
    }
    if (phase != Phase::following) state.SkipWithError("the arm has stopped following");
    state.counters["frames"] = benchmark::Counter(static_cast<double>(driver.counters().received),
                                                  benchmark::Counter::kIsRate);
  }
  std::filesystem::remove_all(directory);
}
BENCHMARK(full_cycle)->ArgName("driver_only")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mimesis::hw
