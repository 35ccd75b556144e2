#pragma once
#include <benchmark/benchmark.h>

#include <cstdint>
#include <functional>
#include <vector>

#include "nodes/planner/test/problemset/problemset.h"

namespace mimesis::planner {

using Path = std::vector<Eigen::VectorXd>;
/// Plans one query with everything that it needs; empty if it fails.
using PlanQuery =
    std::function<Path(const kin::ArmModel&, const Obstacles&, double margin_m, const Query&)>;
/// Plans one query and shortens the path until processor_us() is `end_us`; empty if it fails.
using PlanFor = std::function<Path(const kin::ArmModel&, const Obstacles&, double margin_m,
                                   const Query&, double end_us, std::uint64_t seed)>;

/// Time that this process has had a processor, all threads: what else runs costs nothing.
double processor_us();

/// First path by find_path without a roadmap.
Path plan_first_path(const kin::ArmModel& arm, const Obstacles& obstacles, double margin_m,
                     const Query& query);

/// Plans every query of an arm (0: lwr4p, 1: rx90, 2: planar2, `state.range(0)`) whose straight
/// line is blocked, in five runs of each planner in turns; the least processor time of a query
/// counts.
/// Counters: asked; and for `plan`, `peer`: solved, certified (no part touches anything, proven),
/// median_us, p95_us, worst_us; ratio: median of the peer's time through the plan's.
void plan_blocked_queries(benchmark::State& state, const PlanQuery& plan, const PlanQuery& peer);

/// How much longer than the shortest known (best_lengths.txt) are the paths that `plan` finds of
/// the same queries in 50 ms? Counters: found, of them touching (do not count); mean, median, p95
/// of the ratio. MIMESIS_BEST_LENGTHS=FILE: in MIMESIS_BEST_MS instead, and what is shorter than
/// FILE knows is written to it.
void measure_lengths(benchmark::State& state, const PlanFor& plan);

}  // namespace mimesis::planner
