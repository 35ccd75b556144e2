// The whole step of the node with many characters: decisions, motion, message.
#include <benchmark/benchmark.h>

#include <cmath>

#include "nodes/synthesizer/character/characters.h"
#include "nodes/synthesizer/director.h"
#include "nodes/synthesizer/dynamics/testing/synthetic_model.h"
#include "nodes/synthesizer/synthesizer_messages.h"

namespace mimesis::synthesizer {
namespace {

enum class Load { walking, steered };

void node_step(benchmark::State& state, Load load) {
  const int count = static_cast<int>(state.range(0));
  CharactersSettings settings;
  settings.walking = true;
  const auto starts = form(count, {.spread_phases = true});
  const auto owner = make_figure_director(testing::random_model(1), starts, settings, nullptr);
  Director& director = *owner;
  v1::MotionBatch message;
  std::string bytes;
  double t = 0.0;
  const double step_m = director.characters().repertoire().motion(0).step_length_m;
  for (auto _ : state) {
    for (int i = 0; load == Load::steered && i < count; ++i) {  // every character, in every frame
      const GaitWish wish{.phase_rate_rad_s = 6.0,
                          .step_length_m = step_m * (0.8 + 0.2 * std::sin(3.0 * t)),
                          .heading_rad = 3.0 * t};
      director.characters().set_gait(i, wish, 6.0 * t);
    }
    director.step(nullptr, {});
    to_proto(director, message);
    message.SerializeToString(&bytes);
    benchmark::DoNotOptimize(bytes.data());
    t += 1.0 / 60.0;
  }
  state.counters["message_kB"] = static_cast<double>(bytes.size()) / 1e3;
  state.counters["character"] =
      benchmark::Counter(static_cast<double>(count), benchmark::Counter::kIsIterationInvariantRate |
                                                         benchmark::Counter::kInvert);
}
BENCHMARK_CAPTURE(node_step, walking, Load::walking)->Arg(1)->Arg(300)->Arg(1000)->Arg(10000);
BENCHMARK_CAPTURE(node_step, steered, Load::steered)->Arg(300)->Arg(1000)->Arg(10000);

}  // namespace
}  // namespace mimesis::synthesizer
