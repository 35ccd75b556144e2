// Full cycles on the embedded bus: set-points and SYNC out, the drives answer in the same thread,
// feedback in. With and without the drives' own work. Seven axes of an arm on one bus; thirty of a
// biped on four.
#include <benchmark/benchmark.h>

#include <filesystem>
#include <vector>

#include "hw/cia402/joint_driver.h"
#include "hw/sim/cia402/rack.h"

namespace mimesis::hw {
namespace {

using namespace std::chrono_literals;

constexpr Time kCycle = 5ms;

/// Driver and drives of `on_bus[i]` axes on bus i.
class Bench {
 public:
  Bench(const std::vector<int>& on_bus, const std::string& directory) {
    std::vector<std::unique_ptr<cia402::JointDriver>> parts;
    int node = 0;
    for (std::size_t bus = 0; bus < on_bus.size(); ++bus) {
      const std::string address = "embedded:bench" + std::to_string(bus);
      const auto all = [&](double x) { return Eigen::VectorXd::Constant(on_bus[bus], x); };
      std::vector<sim::DriveConfig> drives;
      cia402::JointDriverOptions options;
      for (int i = 0; i < on_bus[bus]; ++i) {
        options.axes.push_back({.node_id = ++node});
        drives.push_back({.axis = options.axes.back()});
      }
      options.limits = {.q_min = all(-2), .q_max = all(2), .v_max = all(2), .a_max = all(10)};
      racks.push_back(std::make_unique<sim::Rack>(drives, can::open(address, directory)));
      parts.push_back(
          std::make_unique<cia402::JointDriver>(options, can::open(address, directory)));
    }
    q.resize(static_cast<std::size_t>(node), 0.0);
    driver.emplace(std::move(parts));
  }
  Phase cycle(Mode mode) {
    const Phase phase = driver->read(now).phase;
    driver->write(now, {.mode = mode, .position_rad = q});
    return phase;
  }
  void answer() {
    for (const auto& rack : racks) rack->step(now + kCycle / 2);
    now += kCycle;
  }

  std::vector<std::unique_ptr<sim::Rack>> racks;
  std::optional<cia402::GroupDriver> driver;
  std::vector<double> q;
  Time now = 1s;
};

void run(benchmark::State& state, const std::vector<int>& on_bus) {
  std::string directory =
      (std::filesystem::temp_directory_path() / "mimesis-bench-XXXXXX").string();
  if (mkdtemp(directory.data()) == nullptr) return state.SkipWithError("no temporary directory");
  {
    Bench bench(on_bus, directory);
    Phase phase = Phase::starting;
    while (bench.now < 3s) {
      phase = bench.cycle(bench.now < 2s ? Mode::idle : Mode::follow);
      bench.answer();
    }
    if (phase != Phase::following) state.SkipWithError("the robot does not follow");
    const bool driver_only = state.range(0) != 0;
    for (auto _ : state) {
      phase = bench.cycle(Mode::follow);
      if (driver_only) state.PauseTiming();
      bench.answer();
      if (driver_only) state.ResumeTiming();
    }
    if (phase != Phase::following) state.SkipWithError("the robot has stopped following");
    state.counters["frames"] = benchmark::Counter(
        static_cast<double>(bench.driver->traffic().received), benchmark::Counter::kIsRate);
  }
  std::filesystem::remove_all(directory);
}

void full_cycle(benchmark::State& state) { run(state, {7}); }
void biped_cycle(benchmark::State& state) { run(state, {6, 6, 9, 9}); }
BENCHMARK(full_cycle)->ArgName("driver_only")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);
BENCHMARK(biped_cycle)->ArgName("driver_only")->Arg(0)->Arg(1)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace mimesis::hw
