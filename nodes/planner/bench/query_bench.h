#pragma once
#include <benchmark/benchmark.h>

#include <functional>
#include <vector>

#include "nodes/planner/test/problemset/problemset.h"

namespace mimesis::planner {

using Path = std::vector<Eigen::VectorXd>;
/// Plans one query of a scene; empty if it fails.
using PlanQuery = std::function<Path(const Query&)>;
/// Prepares what all queries of a scene share.
using PrepareScene = std::function<PlanQuery(const kin::ArmModel&, const Obstacles&)>;

/// Plans every query of problem set scene `state.range(0)` (LWR4+) whose straight line is blocked,
/// once an iteration. Counters: asked, solved, certified (no part touches anything, proven),
/// median_ms, p95_ms.
void plan_blocked_queries(benchmark::State& state, const PrepareScene& prepare);

}  // namespace mimesis::planner
