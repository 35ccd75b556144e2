// Steps of crowds. items_per_second is agent-steps per second; hz how often a step can be made.
//
// Peer: RVO2 2.0.3 (not in Debian, hence not run here) made 0.63, 1.06 and 1.76 M agent-steps/s in
// its circle scenario at 1e3, 1e4 and 1e5 agents and 1.51, 0.84 and 0.75 M/s in a crossing (discs
// of 0.3 m, others within 5 m, at most 10 of them, 0.1 s, one thread of a loaded AMD EPYC (Zen 4);
// median).
#include <benchmark/benchmark.h>

#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "common/parallel/team.h"
#include "nodes/crowd/engine/crowd.h"

namespace mimesis::crowd {
namespace {

SpeedFunction gait() {
  const std::vector<double> cosine{0.02, 0.05}, sine{0.01, -0.03};
  return {0.22, cosine, sine};
}

/// Two streams that cross at right angles, 0.25 agents/m², everybody on a lane, steps in synchrony
/// by mean field, spacing by step frequency and length: every rule at once.
Crowd crossing(int n) {
  Crowd crowd({.dt_s = 1.0 / 60.0});
  const double side = std::sqrt(n / 0.25);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(0.0, 1.0);
  for (const bool north : {false, true}) {
    Rules rules;
    rules.frequency = {{Topology::all_to_all}, 0.2 / n, 2.0};
    rules.length = {{Topology::all_to_all}, 0.2 / n, 0.3};
    rules.phase = {{Topology::all_to_all}, 1.0 / n};
    rules.heading = {.kind = HeadingKind::lane, .avoid = true};
    const Path path{{0.0, 0.0}, north ? std::numbers::pi / 2 : 0.0};
    const int group = crowd.add_group({rules, gait(), path});
    std::vector<Agent> all;
    const int columns = static_cast<int>(std::sqrt(n));
    for (int i = north ? 1 : 0; i < n; i += 2) {
      Agent a{.id = static_cast<AgentId>(i + 1)};
      a.traits.omega_rad_s = 5.7 + 0.6 * unit(random);
      const Eigen::Vector2d p((i % columns + 0.6 * unit(random)) * side / columns,
                              (i / columns + 0.6 * unit(random)) * side / columns);
      a.state.position_W_m = p;
      a.state.heading_rad = path.direction_rad;
      a.state.phase_rad = 6.0 * unit(random);
      a.traits.place_m = north ? p.y() : p.x();
      a.traits.lane_m = north ? -p.x() : p.y();
      all.push_back(a);
    }
    crowd.add(group, all);
  }
  return crowd;
}

/// Everybody to the opposite place of a circle at 0.25 agents/m² inside.
Crowd circle(int n) {
  Crowd crowd({.dt_s = 1.0 / 60.0});
  Rules rules;
  rules.phase = {{Topology::all_to_all}, 1.0 / n};
  rules.heading = {.kind = HeadingKind::goal, .avoid = true};
  crowd.add_group({rules, gait(), {}});
  std::vector<Agent> all;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (int i = 0; i < n; ++i) {
    const double r = std::sqrt((i + 0.5) / (0.25 * std::numbers::pi));
    Agent a{.id = static_cast<AgentId>(i + 1)};
    a.traits.omega_rad_s = 6.0;
    a.state.position_W_m = r * Eigen::Vector2d(std::cos(golden * i), std::sin(golden * i));
    a.traits.goal_W_m = -a.state.position_W_m;
    a.state.heading_rad = std::remainder(golden * i + std::numbers::pi, 2.0 * std::numbers::pi);
    all.push_back(a);
  }
  crowd.add(0, all);
  return crowd;
}

/// A formation without navigation: rules I, II and III by mean fields.
Crowd formation(int n) {
  Crowd crowd({.dt_s = 1.0 / 60.0});
  Rules rules;
  rules.frequency = {{Topology::all_to_all}, 0.5 / n};
  rules.length = {{Topology::all_to_all}, 0.1 / n};
  rules.phase = {{Topology::all_to_all}, 1.0 / n};
  crowd.add_group({rules, gait(), {}});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  std::vector<Agent> all(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    Agent& a = all[static_cast<std::size_t>(i)];
    a.id = static_cast<AgentId>(i + 1);
    a.traits.omega_rad_s = 6.0;
    a.traits.place_m = -(i % 1000);
    a.state.position_W_m = {a.traits.place_m + unit(random), i / 1000.0};
    a.state.phase_rad = unit(random);
  }
  crowd.add(0, all);
  return crowd;
}

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

void full_crossing(benchmark::State& state) { run(state, crossing); }
void full_circle(benchmark::State& state) { run(state, circle); }
void formation_only(benchmark::State& state) { run(state, formation); }

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
