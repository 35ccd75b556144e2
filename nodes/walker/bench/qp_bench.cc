#include "nodes/walker/bench/mpc_problem.h"
#include "nodes/walker/bench/percentiles.h"

#ifdef MIMESIS_ALGLIB
#include "common/qp/test/peer/alglib_qp.h"
#endif

namespace mimesis::walker {
namespace {

constexpr int kTicks = 1600;  // ten steps

/// Build and solve of a linear MPC at every tick of a walk.
void linear_mpc(benchmark::State& state, qp::DualQp::Start start) {
  Percentiles ticks, solves;
  double iterations = 0.0, active = 0.0, count = 0.0;
  for (auto _ : state) {
    MpcProblem mpc;
    qp::DualQp qp(MpcProblem::kVariables, MpcProblem::kRows);
    for (int tick = 0; tick < kTicks; ++tick) {
      ticks.time([&] {
        mpc.build();
        const qp::Outcome outcome = qp.solve(mpc.view(), start);
        if (outcome != qp::Outcome::solved) state.SkipWithError(qp::name(outcome));
      });
      iterations += qp.iterations();
      active += static_cast<double>(qp.active_rows().size());
      ++count;
      mpc.advance(qp.x());
    }
  }
  ticks.report(state);
  state.counters["iterations"] = iterations / count;
  state.counters["active"] = active / count;
  state.SetItemsProcessed(state.iterations() * kTicks);
}

void mpc_cold(benchmark::State& state) { linear_mpc(state, qp::DualQp::Start::cold); }
void mpc_warm(benchmark::State& state) { linear_mpc(state, qp::DualQp::Start::warm); }
BENCHMARK(mpc_cold)->Name("qp/mpc_like_tick/cold")->Unit(benchmark::kMillisecond);
BENCHMARK(mpc_warm)->Name("qp/mpc_like_tick/warm")->Unit(benchmark::kMillisecond);

#ifdef MIMESIS_ALGLIB
void mpc_alglib(benchmark::State& state) {
  Percentiles ticks;
  for (auto _ : state) {
    MpcProblem mpc;
    for (int tick = 0; tick < 160; ++tick) {
      Eigen::VectorXd x;
      ticks.time([&] {
        mpc.build();
        x = qp::alglib_minimum(mpc.view());
      });
      mpc.advance(x);
    }
  }
  ticks.report(state);
}
BENCHMARK(mpc_alglib)->Name("peer/alglib_dense_ipm/mpc_like_tick")->Unit(benchmark::kMillisecond);
#endif

}  // namespace
}  // namespace mimesis::walker
