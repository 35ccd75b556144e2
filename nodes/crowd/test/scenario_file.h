#pragma once
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "common/error.h"
#include "common/testing/temporary_folder.h"
#include "nodes/crowd/crowd_node.h"

namespace mimesis::crowd::testing {

inline constexpr const char* kGaits = R"(
gaits:
  - {name: walk, eigenfrequency_rad_s: 5.7, mean_m_rad: 0.22, cosine_m_rad: [-0.006, 0.023], sine_m_rad: [0.0, 0.022]}
  - {name: brisk, eigenfrequency_rad_s: 7.1, mean_m_rad: 0.26, cosine_m_rad: [0.006, 0.023]}
)";

inline constexpr const char* kFormation = R"(
name: formation
until_s: 1000
groups:
  - name: square
    count: 16
    gait: walk
    origin_x_m: -2
    start: {columns: 4, spacing_m: 1.8, across_m: 1.4, jitter_m: 0.4}
    formation: {shape: grid, columns: 4, spacing_m: 1.5, across_m: 1.2}
    rules:
      length: {graph: all_to_all, gain_1_m: 0.02, limit: 0.4}
      phase: {graph: all_to_all, gain_1_s: 0.06}
      heading: {kind: lane, gain: 0.6}
)";

inline constexpr const char* kChain = R"(
name: chain
until_s: 1000
groups:
  - name: column
    count: 9
    gait: walk
    origin_x_m: -2
    start: {columns: 3, spacing_m: 1.8, across_m: 1.4, jitter_m: 0.4}
    formation: {shape: grid, columns: 3, spacing_m: 1.5, across_m: 1.2}
    rules:
      length: {graph: chain, gain_1_m: 0.4, limit: 0.4}
      phase: {graph: chain, gain_1_s: 2.0}
      heading: {kind: lane, gain: 0.6}
)";

inline constexpr const char* kLeader = R"(
name: leader
until_s: 1000
groups:
  - name: followers
    count: 6
    gait: walk
    origin_x_m: -1
    spread_rad_s: 0.2
    start: {columns: 3, jitter_m: 0.2}
    rules:
      phase: {graph: all_to_all, gain_1_s: 0.2, leader_gain_1_s: 1.0}
      heading: {kind: consensus, gain: 0.3}
)";

inline constexpr const char* kBeat = R"(
name: beat
until_s: 1000
beat: {phase_rad: 0.5, rate_rad_s: 5.7}
groups:
  - name: dancers
    count: 6
    gait: walk
    origin_x_m: -1
    start: {columns: 3, jitter_m: 0.2}
    rules:
      phase: {graph: all_to_all, gain_1_s: 0.2}
    beat_gain_1_s: 1.0
)";

/// A scenario in a temporary file.
class ScenarioFile {
 public:
  explicit ScenarioFile(const std::string& text) { std::ofstream(path()) << text << kGaits; }

  std::string path() const { return folder_ / "scenario.yaml"; }
  CrowdParams params() const {
    CrowdParams p;
    p.scenario = path();
    return p;
  }

 private:
  mimesis::testing::TemporaryFolder folder_;
};

}  // namespace mimesis::crowd::testing
