// Steps of crowds. items_per_second is agent-steps per second; hz how often a step can be made.
//
// Peer: RVO2 2.0.3 (not in Debian, hence not run here) made 0.63, 1.06 and 1.76 M agent-steps/s in
// its circle scenario at 1e3, 1e4 and 1e5 agents and 1.51, 0.84 and 0.75 M/s in a crossing (discs
// of 0.3 m, others within 5 m, at most 10 of them, 0.1 s, one thread of a loaded AMD EPYC (Zen 4);
// median).
#include <benchmark/benchmark.h>

#include <memory>

#include "common/parallel/team.h"
#include "nodes/crowd/figures/crowds.h"

namespace mimesis::crowd {
namespace {

template <class Make>
void run(benchmark::State& state, Make make) {
  const int n = static_cast<int>(state.range(0)), threads = static_cast<int>(state.range(1));
  Crowd crowd = make(n);
  const auto team = threads > 1 ? std::make_unique<parallel::Team>(threads) : nullptr;
  for (int i = 0; i < 30; ++i) crowd.step(team.get());
  for (auto _ : state) crowd.step(team.get());
  state.SetItemsProcessed(state.iterations() * n);
  state.counters["hz"] =
      benchmark::Counter(static_cast<double>(state.iterations()), benchmark::Counter::kIsRate);
  state.counters["bytes_per_agent"] = crowd.bytes_per_agent();
  state.counters["held"] = crowd.contacts().held;
  state.counters["overlapping"] = crowd.contacts().overlapping;
}

void full_crossing(benchmark::State& state) { run(state, crossing_crowd); }
void full_circle(benchmark::State& state) { run(state, circle_crowd); }
void formation_only(benchmark::State& state) { run(state, formation_crowd); }

void sizes(benchmark::internal::Benchmark* b, int most) {
  b->ArgNames({"agents", "threads"})->UseRealTime()->Unit(benchmark::kMillisecond);
  for (const int threads : {1, 2}) {
    for (int n = 100; n <= most; n *= 10) b->Args({n, threads});
  }
}

BENCHMARK(full_crossing)->Apply([](auto* b) { sizes(b, 1'000'000); });
BENCHMARK(full_circle)->Apply([](auto* b) { sizes(b, 100'000); });
BENCHMARK(formation_only)->Apply([](auto* b) { sizes(b, 1'000'000); });

}  // namespace
}  // namespace mimesis::crowd
