// The dynamic filter's tick: 20 samples of inverse kinematics and inverse dynamics.
#include <benchmark/benchmark.h>

#include "common/robot/test/test_bipeds.h"
#include "nodes/walker/bench/percentiles.h"
#include "nodes/walker/filter/dynamic_filter.h"
#include "nodes/walker/filter/test/plain_walk.h"
#include "nodes/walker/pattern/generators.h"
#include "nodes/walker/testing/filtered_walk.h"

namespace mimesis::walker {
namespace {

void filter(benchmark::State& state) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  const FilterSettings settings{.iterations = static_cast<int>(state.range(0))};
  LinearMpc pattern(gait);
  const double y = 0.5 * biped.feet_distance_m;
  pattern.reset(
      {Footprint{.side = kLeft, .p_W_m = {0.0, y}}, Footprint{.side = kRight, .p_W_m = {0.0, -y}}});
  DynamicFilter filter(biped, gait, settings);
  const SwingingArms arms(biped, 1.0);
  std::vector<UpperBody> upper(static_cast<std::size_t>(settings.samples));
  Percentiles percentiles;
  int tick = 0;
  for (auto _ : state) {
    state.PauseTiming();
    pattern.step(wish(0.3));
    for (std::size_t k = 0; k < upper.size(); ++k) {
      arms.at((tick + static_cast<int>(k) * filter.ticks_a_sample()) * kTick_s, upper[k]);
    }
    ++tick;
    state.ResumeTiming();
    percentiles.time([&] { benchmark::DoNotOptimize(filter.step(pattern, upper)); });
  }
  percentiles.report(state);
}
BENCHMARK(filter)->Name("filter/iterations")->Arg(1)->Arg(2)->Iterations(2000);

/// Planned poses and rates to a motion of all joints and its ZMP: one sample.
void whole_body(benchmark::State& state) {
  const robot::Biped biped = robot::hrp2_like();
  const GaitSettings gait = gait_settings(biped);
  LinearMpc pattern(gait);
  const double y = 0.5 * biped.feet_distance_m;
  pattern.reset(
      {Footprint{.side = kLeft, .p_W_m = {0.0, y}}, Footprint{.side = kRight, .p_W_m = {0.0, -y}}});
  for (int i = 0; i < 500; ++i) pattern.step(wish(0.3));
  WholeBody body(biped, gait.com_height_m);
  UpperBody upper;
  SwingingArms(biped, 1.0).at(4.0, upper);
  for (auto _ : state) {
    benchmark::DoNotOptimize(
        body.zmp(pattern.now(), pattern.now().com, upper, body.moments(upper)));
  }
}
BENCHMARK(whole_body)->Name("filter/sample");

/// A leg's posture from the one a sample of the filter (35 ms) before, along a stride of 0.3 m with
/// the foot up by 50 mm; the hip's axes miss each other by the
/// argument.
void leg_ik(benchmark::State& state) {
  const Eigen::Vector3d miss =
      1e-3 * static_cast<double>(state.range(0)) * Eigen::Vector3d(1, 0, 1);
  const robot::Biped hrp2 = robot::hrp2_like();
  std::vector<robot::Link> links = hrp2.tree.links();
  const auto& dof = hrp2.leg[kLeft].dof;
  links[static_cast<std::size_t>(hrp2.tree.moved_link(dof[1]))].X_PJ.translation() += miss;
  links[static_cast<std::size_t>(hrp2.tree.moved_link(dof[2]))].X_PJ.translation() -= miss;
  const robot::Biped biped =
      robot::make_biped(robot::RobotTree("bench", links), robot::hrp2_names());
  const robot::LegIk ik(biped, kLeft);
  robot::LegIk::Vector6d q = biped.half_sitting(biped.leg[kLeft].dof);
  Percentiles times;
  int i = 0;
  for (auto _ : state) {
    const double phase = 0.05 * 2.0 * 3.14159265358979 * (i++ % 20);
    Eigen::Isometry3d X_BS = biped.X_WB_half_sitting.inverse();
    X_BS.translation() +=
        Eigen::Vector3d(0.15 * std::cos(phase), 0.095, 0.05 * std::max(0.0, std::sin(phase)));
    times.time([&] { q = ik.solve(X_BS, 0.01, &q).q; });
  }
  times.report(state);
}
BENCHMARK(leg_ik)->Name("leg_ik/axes_miss_by_mm")->Arg(0)->Arg(20)->Iterations(200000);

}  // namespace
}  // namespace mimesis::walker
