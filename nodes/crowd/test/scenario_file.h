#pragma once
#include <cstdlib>
#include <fstream>
#include <string>

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
