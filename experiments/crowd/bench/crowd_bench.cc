// Steps of crowds, and of RVO2 on the same agents. items_per_second is agent-steps per second, of
// processor time on one thread and of wall time on several; hz how often a step can be made. All
// start again after some simulated seconds, so that crowds are equally dense in both.
#include <benchmark/benchmark.h>

#include <memory>

#include "common/parallel/team.h"
#include "experiments/crowd/crowds.h"
#include "experiments/crowd/rvo2.h"

namespace mimesis::crowd {
namespace {

constexpr double kBegin_s = 0.5, kEnd_s = 3.5;  // simulated time

/// Times steps of what `make` makes, a pointer; returns the last one.
template <class Make, class Step>
auto run(benchmark::State& state, Make make, Step step) {
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
  state.SetItemsProcessed(state.iterations() * state.range(0));
  state.counters["hz"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  return crowd;
}

void ours(benchmark::State& state, Crowd (*make)(int)) {
  const int n = static_cast<int>(state.range(0)), threads = static_cast<int>(state.range(1));
  const auto team = threads > 1 ? std::make_unique<parallel::Team>(threads) : nullptr;
  const auto crowd = run(
      state, [&] { return std::make_unique<Crowd>(make(n)); },
      [&](Crowd& c) { c.step(team.get()); });
  state.counters["bytes_per_agent"] = crowd->bytes_per_agent();
  state.counters["held"] = crowd->contacts().held;
  state.counters["overlapping"] = crowd->contacts().overlapping;
}

void peer(benchmark::State& state, Crowd (*make)(int)) {
  if (!Rvo2::built()) {
    state.SkipWithError("RVO2 is not here: cmake --build build --target peers, and build again");
    return;
  }
  const int n = static_cast<int>(state.range(0)), threads = static_cast<int>(state.range(1));
  run(
      state, [&] { return Rvo2::make(make(n), threads); }, [](Rvo2& r) { r.step(); });
}

void full_crossing(benchmark::State& state) { ours(state, crossing_crowd); }
void full_circle(benchmark::State& state) { ours(state, circle_crowd); }
void formation_only(benchmark::State& state) { ours(state, formation_crowd); }
void rvo2_crossing(benchmark::State& state) { peer(state, crossing_crowd); }
void rvo2_circle(benchmark::State& state) { peer(state, circle_crowd); }

template <int kThreads>
void sizes(benchmark::internal::Benchmark* b, int most) {
  b->ArgNames({"agents", "threads"})->Unit(benchmark::kMillisecond);
  if (kThreads > 1) b->UseRealTime();
  for (int n = 100; n <= most; n *= 10) b->Args({n, kThreads});
}

#define MIMESIS_SIZES(function, name, most)                                   \
  BENCHMARK(function)->Name(name)->Apply([](auto* b) { sizes<1>(b, most); }); \
  BENCHMARK(function)->Name(name)->Apply([](auto* b) { sizes<2>(b, most); })

MIMESIS_SIZES(full_crossing, "full_crossing", 1'000'000);
MIMESIS_SIZES(rvo2_crossing, "peer/rvo2_crossing", 100'000);
MIMESIS_SIZES(full_circle, "full_circle", 100'000);
MIMESIS_SIZES(rvo2_circle, "peer/rvo2_circle", 100'000);
MIMESIS_SIZES(formation_only, "formation_only", 1'000'000);

}  // namespace
}  // namespace mimesis::crowd
