#pragma once
#include <cstdint>

namespace mimesis::crowd {

/// Time of the first step of the coordinator under test.
inline constexpr std::uint64_t kFuzzBegin_ns = 100'020'000'000;

/// Scenario of the coordinator under test: routes, a graph, all-to-all, avoidance, an external
/// agent, a character.
inline constexpr const char* kFuzzScenario = R"(
name: fuzz
until_s: 1000
groups:
  - name: round
    count: 3
    gait: walk
    start: {arrangement: row}
    goals: {aim: route, position_m: [4, 0, 4, 4, 0, 4], loop: true, reached_m: 1}
    rules:
      heading: {kind: goal, gain: 1, avoid: true}
  - name: column
    count: 3
    gait: walk
    origin_y_m: 5
    formation: {shape: grid, columns: 1}
    rules:
      length: {graph: chain, gain_1_m: 0.4, limit: 0.4}
      phase: {graph: chain, gain_1_s: 2.0}
      heading: {kind: lane, gain: 0.6}
  - name: all
    count: 3
    gait: walk
    origin_y_m: 9
    formation: {shape: row}
    rules:
      length: {graph: all_to_all, gain_1_m: 0.02, limit: 0.4}
      phase: {graph: all_to_all, gain_1_s: 0.06}
      heading: {kind: consensus, gain: 0.6}
externals:
  - {name: figure, group: all}
  - {name: robot, group: column}
)";

}  // namespace mimesis::crowd
