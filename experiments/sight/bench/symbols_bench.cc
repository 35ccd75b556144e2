// From a picture as a camera gives it (YUYV) to what vision tells of it, over a whole demonstration
// in a scene that vision was not told. The search for the hand at its begin is among the pictures.
#include <benchmark/benchmark.h>
#include <time.h>

#include <chrono>

#include "experiments/sight/hand_runs.h"
#include "experiments/sight/shown_scene.h"
#include "nodes/vision/testing/yuyv_of.h"

namespace mimesis::sight {
namespace {

constexpr std::uint64_t kSeed = 4301;  // no constant was chosen on it
constexpr double kPicture_s = 1.0 / 30.0;

double cpu_ms() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double clock_ms() {
  return std::chrono::duration<double, std::milli>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

/// @param state  range: 1 camera, or 2 with the model of the hand
void frame_to_symbols(benchmark::State& state) {
  const bool stereo = state.range(0) == 2;
  camera::Picture usual;
  usual.script.demonstration = {task::Grip::full, task::Transport::below, task::Goal::low};
  Shown shown(camera::random_scene(usual, kSeed));
  const auto fresh = [&] {
    if (stereo) return watcher_for(shown, kSeed);
    vision::WatcherSetup setup;
    setup.camera = camera::calibrated(shown.scene.cameras, kSeed)[0];
    vision::TableWatcher watcher(setup);
    shown.render(0.0);
    teach(watcher, shown.seen_left, camera::clicks(shown.scene.picture, shown.scene.cameras[0]));
    return watcher;
  };
  vision::TableWatcher watcher = fresh();
  std::vector<vision::YuyvImage> left, right;
  for (double t = 0.0; t < shown.left.end_s() + 0.5; t += kPicture_s) {
    shown.render(t);
    left.push_back(vision::yuyv_of(shown.seen_left));
    right.push_back(vision::yuyv_of(shown.seen_right));
  }
  std::vector<double> cpu, clock;
  for (auto _ : state) {
    for (std::size_t k = 0; k < left.size(); ++k) {
      const double cpu_0 = cpu_ms(), clock_0 = clock_ms();
      if (stereo) watcher.watch_right(right[k]);
      watcher.watch(left[k]);
      clock.push_back(clock_ms() - clock_0);
      cpu.push_back(cpu_ms() - cpu_0);
    }
  }
  state.counters["pictures"] = static_cast<double>(left.size());
  state.counters["cpu_median_ms"] = quantile(cpu, 0.5);
  state.counters["cpu_p99_ms"] = quantile(cpu, 0.99);
  state.counters["clock_median_ms"] = quantile(clock, 0.5);
  state.counters["clock_p99_ms"] = quantile(clock, 0.99);
  state.counters["clock_max_ms"] = quantile(clock, 1.0);
  const vision::ActionRecognizer& told = watcher.action();
  if (told.grip().value != task::Grip::full || told.transport().value != task::Transport::below ||
      told.goal().value != task::Goal::low)
    state.SkipWithError("the symbols are wrong");
}
BENCHMARK(frame_to_symbols)
    ->ArgName("cameras")
    ->Arg(1)
    ->Arg(2)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mimesis::sight
