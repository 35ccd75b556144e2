#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <random>
#include <vector>

#include "nodes/walker/pattern/generators.h"

namespace mimesis::walker {
namespace {

/// Two minutes of walking with a new wish every second or so, stops and landings among them.
std::vector<Wish> wishes() {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  std::vector<Wish> result;
  Wish wish;
  while (result.size() < 24000) {
    wish.velocity_m_s = {0.35 * uniform(random), 0.1 * uniform(random)};
    wish.yaw_rate_rad_s = 0.2 * uniform(random);
    wish.walk = uniform(random) > -0.8;
    result.insert(result.end(), 100 + static_cast<std::size_t>(200.0 + 199.0 * uniform(random)),
                  wish);
  }
  return result;
}

void report(benchmark::State& state, std::vector<double>& us) {
  std::sort(us.begin(), us.end());
  state.counters["median_us"] = us[us.size() / 2];
  state.counters["p99_us"] = us[us.size() * 99 / 100];
  state.counters["max_us"] = us.back();
}

/// Every tick of the walk; each is timed and the least of its repetitions counts, so that another
/// program on the core is no part of the worst.
template <typename Pattern, typename Before>
void walk(benchmark::State& state, Before before_tick) {
  const std::vector<Wish> all = wishes();
  std::vector<double> us(all.size(), 1e9);
  for (auto _ : state) {
    Pattern pattern{GaitSettings{}};
    for (std::size_t i = 0; i < all.size(); ++i) {
      before_tick(pattern);
      const auto start = std::chrono::steady_clock::now();
      pattern.step(all[i]);
      const std::chrono::duration<double, std::micro> taken =
          std::chrono::steady_clock::now() - start;
      us[i] = std::min(us[i], taken.count());
    }
  }
  report(state, us);
}

void pattern_linear_mpc_warm(benchmark::State& state) {
  walk<LinearMpc>(state, [](LinearMpc&) {});
}
void pattern_linear_mpc_cold(benchmark::State& state) {
  walk<LinearMpc>(state, [](LinearMpc& pattern) { pattern.forget(); });
}
void pattern_nonlinear_mpc_warm(benchmark::State& state) {
  walk<NonlinearMpc>(state, [](NonlinearMpc&) {});
}
void pattern_nonlinear_mpc_cold(benchmark::State& state) {
  walk<NonlinearMpc>(state, [](NonlinearMpc& pattern) { pattern.forget(); });
}
void pattern_preview(benchmark::State& state) {
  walk<PreviewPattern>(state, [](PreviewPattern&) {});
}
BENCHMARK(pattern_linear_mpc_warm)->Unit(benchmark::kMillisecond)->Iterations(3);
BENCHMARK(pattern_linear_mpc_cold)->Unit(benchmark::kMillisecond)->Iterations(3);
BENCHMARK(pattern_nonlinear_mpc_warm)->Unit(benchmark::kMillisecond)->Iterations(3);
BENCHMARK(pattern_nonlinear_mpc_cold)->Unit(benchmark::kMillisecond)->Iterations(3);
BENCHMARK(pattern_preview)->Unit(benchmark::kMillisecond)->Iterations(3);

}  // namespace
}  // namespace mimesis::walker
