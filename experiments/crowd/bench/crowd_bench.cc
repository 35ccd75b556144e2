// Streams of agents that cross, and those of RVO2 on the same agents, in simulated seconds: agent_s
// at equal steps, and at the largest step of each with `admissible` = 1, that is nearly as good as
// with its own finest one (quality.h). hz is how often a step can be made. All start again after
// some simulated seconds, so that crowds are equally dense in both. Steps by number of agents:
// `mimesis reproduce crowd-scaling`.
#include <benchmark/benchmark.h>

#include <map>
#include <memory>
#include <tuple>

#include "experiments/crowd/quality.h"
#include "experiments/crowd/rvo2.h"

namespace mimesis::crowd {
namespace {

constexpr double kBegin_s = 0.5, kEnd_s = 3.5;  // simulated time
constexpr double kFinest_s = 1.0 / 240.0;

/// Times steps of what `make` makes, a pointer.
template <class Make, class Step>
void run(benchmark::State& state, Make make, Step step) {
  const auto begun = [&] {
    auto crowd = make();
    while (crowd->time_s() < kBegin_s) step(*crowd);
    return crowd;
  };
  auto crowd = begun();
  for (auto _ : state) {
    if (crowd->time_s() > kEnd_s) {
      state.PauseTiming();
      crowd = begun();
      state.ResumeTiming();
    }
    step(*crowd);
  }
  state.counters["hz"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
}

enum class Who { engine, rvo2 };

std::unique_ptr<Movers> moved_by(Who who, World world, double step_s) {
  if (who == Who::engine) return move_by_engine(std::move(world.crowd), 1);
  return Rvo2::make(world.crowd, {.step_s = step_s}, world.walls);
}

/// Quality does not depend on the machine: once is enough.
const Quality& quality_of(Who who, double per_m2, double step_s) {
  static std::map<std::tuple<Who, double, double>, Quality> known;
  const auto [at, fresh] = known.try_emplace({who, per_m2, step_s});
  if (fresh) {
    at->second = quality([&](World w) { return moved_by(who, std::move(w), step_s); }, per_m2,
                         {.dt_s = step_s});
  }
  return at->second;
}

void streaming(benchmark::State& state, Who who) {
  if (!Rvo2::built()) {
    state.SkipWithError("RVO2 is not here: cmake --build build --target peers, and build again");
    return;
  }
  constexpr int kAgents = 10'000;
  const double per_m2 = 0.01 * static_cast<double>(state.range(0));
  const double step_s = 1e-6 * static_cast<double>(state.range(1));
  run(
      state, [&] { return moved_by(who, streams(kAgents, per_m2, {.dt_s = step_s}, 1), step_s); },
      [](Movers& m) { m.step(); });
  const double simulated_s = static_cast<double>(state.iterations()) * step_s;
  state.counters["agent_s"] =
      benchmark::Counter(kAgents * simulated_s, benchmark::Counter::kIsRate);
  const Quality& q = quality_of(who, per_m2, step_s);
  state.counters["overlaps"] = q.overlaps;
  state.counters["flow_1_s"] = q.flow_1_s;
  state.counters["flow_error_1_s"] = q.flow_error_1_s;
  state.counters["delay_s"] = q.delay_s;
  state.counters["admissible"] = q.admissible(quality_of(who, per_m2, kFinest_s)) ? 1.0 : 0.0;
}

void streams_ours(benchmark::State& state) { streaming(state, Who::engine); }
void streams_rvo2(benchmark::State& state) { streaming(state, Who::rvo2); }

void densities(benchmark::internal::Benchmark* b) {
  b->ArgNames({"per_100_m2", "step_us"})->Unit(benchmark::kMillisecond);
  b->ArgsProduct({{25, 100, 200, 400}, {8'333, 16'667, 33'333, 50'000, 100'000, 200'000, 250'000}});
}
BENCHMARK(streams_ours)->Name("streams")->Apply(densities);
BENCHMARK(streams_rvo2)->Name("peer/rvo2_streams")->Apply(densities);

}  // namespace
}  // namespace mimesis::crowd
