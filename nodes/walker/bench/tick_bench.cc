// The whole tick of 5 ms: pattern, filter, stabilizer, stack, on a robot that does as told.
#include "common/model/files.h"
#include "nodes/walker/bench/percentiles.h"
#include "nodes/walker/test/closed_loop.h"

namespace mimesis::walker {
namespace {

using testing::ClosedLoop;

constexpr int kTicks = 3200;  // 16 s: starts, walks, stops at 14 s

const robot::Biped& biped() {
  static const robot::Biped b = model::load_biped("biped.yaml");
  return b;
}

/// A walk at 0.25 m/s in a curve with swinging arms; `change` makes it harder.
template <typename Change>
void ticks(benchmark::State& state, PatternKind pattern, int iterations, Change change) {
  WalkerSettings settings;
  settings.pattern = pattern;
  settings.filter_settings.iterations = iterations;
  Percentiles times;
  double limited = 0.0, over_a_millisecond = 0.0;
  for (auto _ : state) {
    ClosedLoop loop(biped(), settings);
    WalkerWish wish;
    const WalkerOutput* out = nullptr;
    for (int tick = 0; tick < kTicks; ++tick) {
      const double t_s = tick * kTick_s;
      wish.walk.velocity_m_s = {0.25, 0.0};
      wish.walk.yaw_rate_rad_s = 0.1;
      wish.walk.walk = t_s > 0.5 && t_s < 14.0;
      testing::swing_upper_body(biped(), t_s, wish);
      wish.hand = {};
      change(t_s, out, wish);
      const Sensors& sensors = loop.sense();
      const double us = times.time([&] { out = &loop.walker.step(wish, sensors); });
      over_a_millisecond += us > 1000.0 ? 1.0 : 0.0;
      limited += out->limited || out->clipped ? 1.0 : 0.0;
      if (out->failed || out->stabilizer.falling) state.SkipWithError(out->trouble.c_str());
      loop.obey(*out);
    }
    if (!loop.fault.empty()) state.SkipWithError(loop.fault.c_str());
  }
  times.report(state);
  state.counters["over_1_ms"] = over_a_millisecond;
  state.counters["limited"] = limited / static_cast<double>(state.iterations() * kTicks);
}

void walk(benchmark::State& state, PatternKind pattern, int iterations) {
  ticks(state, pattern, iterations, [](double, const WalkerOutput*, WalkerWish&) {});
}

/// Both hands reach 10 cm farther than the arms are long.
void reach(benchmark::State& state, PatternKind pattern, int iterations) {
  ticks(state, pattern, iterations, [](double t_s, const WalkerOutput* out, WalkerWish& wish) {
    if (out == nullptr) return;
    for (const Side side : robot::kSides) {
      wish.hand[side].share = std::clamp(t_s - 2.0, 0.0, 1.0);
      wish.hand[side].p_W_m = out->X_WB * Eigen::Vector3d(0.75, robot::sign(side) * 0.25, 0.35);
    }
  });
}

/// All joints of the upper body are wished beyond their limits, now above and now below.
void strain(benchmark::State& state, PatternKind pattern, int iterations) {
  ticks(state, pattern, iterations, [](double t_s, const WalkerOutput*, WalkerWish& wish) {
    wish.upper_body.array() += std::fmod(t_s, 4.0) < 2.0 ? 3.0 : -3.0;
  });
}

#define MIMESIS_TICK(call, name, ...)        \
  BENCHMARK_CAPTURE(call, name, __VA_ARGS__) \
      ->Name("tick/" #call "/" #name)        \
      ->Unit(benchmark::kMillisecond)        \
      ->Iterations(2)

MIMESIS_TICK(walk, linear_filter_1, PatternKind::linear, 1);
MIMESIS_TICK(walk, linear_filter_2, PatternKind::linear, 2);
MIMESIS_TICK(walk, nonlinear_filter_1, PatternKind::nonlinear, 1);
MIMESIS_TICK(walk, nonlinear_filter_2, PatternKind::nonlinear, 2);
MIMESIS_TICK(walk, preview_filter_1, PatternKind::preview, 1);
MIMESIS_TICK(reach, linear_filter_2, PatternKind::linear, 2);
MIMESIS_TICK(reach, nonlinear_filter_2, PatternKind::nonlinear, 2);
MIMESIS_TICK(strain, nonlinear_filter_2, PatternKind::nonlinear, 2);

}  // namespace
}  // namespace mimesis::walker
