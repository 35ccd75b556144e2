// Speed of demixing, on one core: set A where the shared folder is there, else as many seeded
// trajectories.
#include <benchmark/benchmark.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "common/math/circle.h"
#include "common/motion/demix/sisa.h"
#include "common/motion/mocap/trials.h"
#include "common/shared_data.h"

namespace mimesis::demix {
namespace {

/// 34 trials of 51 rows, 100 samples: harmonics that fall off as those of walking do.
mocap::Trials made_set() {
  mocap::Trials set;
  for (int r = 0; r < 51; ++r) set.rows.push_back("row" + std::to_string(r));
  set.trials.resize(34);
  set.samples.setZero(34 * 51, 100);
  std::mt19937 random(1);
  const auto uniform = [&] { return static_cast<double>(random()) / 4294967296.0; };
  for (Eigen::Index n = 0; n < set.samples.rows(); ++n) {
    for (int f = 1; f <= 9; ++f) {
      const double weight = uniform() * std::pow(0.55, f), phase = math::kTwoPi * uniform();
      for (Eigen::Index t = 0; t < 100; ++t) {
        set.samples(n, t) +=
            weight * std::cos(math::kTwoPi * f * static_cast<double>(t) / 100.0 + phase);
      }
    }
  }
  return set;
}

const mocap::Trials& set_a() {
  static const mocap::Trials set = [] {
    const std::filesystem::path file = shared_data("data/mocap/sets/A.csv");
    return std::filesystem::exists(file) ? mocap::read_trials(file.string()) : made_set();
  }();
  return set;
}

void demix_free(benchmark::State& state) {
  double q = 0.0;
  for (auto _ : state) q = sisa(set_a(), {.sources = static_cast<int>(state.range(0))}).quality;
  state.counters["Q"] = q;
}

void demix_tied(benchmark::State& state) {
  double q = 0.0;
  for (auto _ : state) {
    q = sisa(set_a(), {.sources = static_cast<int>(state.range(0)), .tied = true}).quality;
  }
  state.counters["Q"] = q;
}

void demix_pca(benchmark::State& state) {
  for (auto _ : state) {
    benchmark::DoNotOptimize(principal_components(set_a(), static_cast<int>(state.range(0))));
  }
}

BENCHMARK(demix_free)->Arg(3)->Arg(4)->Unit(benchmark::kMillisecond);
BENCHMARK(demix_tied)->Arg(4)->Unit(benchmark::kMillisecond);
BENCHMARK(demix_pca)->Arg(8)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mimesis::demix
